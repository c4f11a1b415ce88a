"""How many inputs a run of the suite has tried."""

from pathlib import Path

import pytest

from tests.robustness.support import TRIED

HERE = Path(__file__).parent


def test_at_least_5000_inputs_were_tried(request):
    here = {item.path for item in request.session.items if item.path.parent == HERE}
    if here != set(HERE.glob("test_*.py")):
        pytest.skip("only a part of the suite runs")
    for kind, count in sorted(TRIED.items()):
        print(f"{count:6} {kind}")
    assert TRIED.total() >= 5000
