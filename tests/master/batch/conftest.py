"""The toy scenario as a system, for batches."""

import pytest

from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides


@pytest.fixture
def toy_system(toy):
    """The toy scenario's system."""
    with open_scenario(toy, Overrides(), build=False) as found:
        yield found.system
