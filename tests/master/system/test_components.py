"""The number of macro steps."""

import pytest

from master.ssp.run_settings import RunSettings
from master.system.components import System


@pytest.mark.parametrize(
    ("start", "stop", "step", "count"),
    [
        (0.0, 7.8, 1e-3, 7800),
        (0.0, 0.3, 0.1, 3),  # 0.3 / 0.1 is 2.9999999999999996
        (0.1, 0.7, 0.1, 6),
        (0.0, 1.0, 0.3, 3),  # never beyond the stop time
        (0.0, 0.1, 0.1, 1),
    ],
)
def test_step_count(start, stop, step, count):
    assert System("s", (), (), start, stop, step, RunSettings()).step_count == count
