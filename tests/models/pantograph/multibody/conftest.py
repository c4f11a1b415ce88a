"""Shared mechanisms: assembled once."""

from __future__ import annotations

import pytest

from models.numerics.kernel_cache import SWITCH
from models.pantograph.multibody.analysis.mechanism_statics import settle_springs
from models.pantograph.multibody.mechanism import Mechanism
from tests.models.pantograph.multibody.mechanisms import library


@pytest.fixture(scope="module", autouse=True)
def _plain():
    """Let mechanisms be plain here, but where kernels are compared: it is the reference that is looked at."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(SWITCH, "numpy")
        yield


@pytest.fixture(scope="session")
def generic():
    mechanism = Mechanism(library("generic_multibody"))
    return mechanism, settle_springs(mechanism)
