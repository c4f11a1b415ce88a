"""How many inputs a run of the suite has tried."""

from pathlib import Path

import pytest

from tests.effort import count
from tests.robustness.support import TRIED

HERE = Path(__file__).parent
#: Kinds of which every run tries some.
KINDS = (
    "FMU", "archive", "cache file", "command line", "definition", "description", "hostile", "inline set", "mapping",
    "measurement", "mechanism", "parameter set", "response", "results", "scenario", "study", "table", "unit",
)  # fmt: skip


def test_at_least_5000_inputs_were_tried(request):
    here = {item.path for item in request.session.items if item.path.parent == HERE}
    if here != set(HERE.glob("test_*.py")):
        pytest.skip("only a part of the suite runs")
    for kind, number in sorted(TRIED.items()):
        print(f"{number:6} {kind}")
    assert TRIED.total() >= count(5000, 20000)
    missing = [kind for kind in KINDS if not any(tried.startswith(kind) for tried in TRIED)]
    assert missing == []
