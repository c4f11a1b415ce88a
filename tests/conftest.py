"""What holds for the whole suite: long checks on request, groups of tests that share one process."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.effort import IS_LONG

ROBUSTNESS = Path(__file__).parent / "robustness"


def pytest_itemcollected(item: pytest.Item) -> None:
    """Keep the robustness tests, which add up their inputs, in one process of pytest-xdist."""
    if item.path.is_relative_to(ROBUSTNESS):
        item.add_marker(pytest.mark.xdist_group("robustness"))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the long checks out unless asked for."""
    if not IS_LONG:
        left_out = [item for item in items if item.get_closest_marker("long")]
        items[:] = [item for item in items if not item.get_closest_marker("long")]
        config.hook.pytest_deselected(items=left_out)
