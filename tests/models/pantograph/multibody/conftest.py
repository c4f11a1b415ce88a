"""Shared mechanisms: assembled once."""

from __future__ import annotations

import pytest

from models.pantograph.multibody.analysis.mechanism_statics import settle_springs
from models.pantograph.multibody.mechanism import Mechanism
from tests.models.pantograph.multibody.mechanisms import library


@pytest.fixture(scope="session")
def generic():
    mechanism = Mechanism(library("generic_multibody"))
    return mechanism, settle_springs(mechanism)
