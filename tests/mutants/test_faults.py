"""Tests have teeth: every listed fault in the code makes a fast test near it fail."""

from __future__ import annotations

import pytest

from tests.mutants.faults import ROOT, Copy, Fault, read

FAULTS = read()


@pytest.mark.parametrize("fault", FAULTS, ids=[fault.key for fault in FAULTS])
def test_a_listed_fault_still_has_its_place(fault: Fault) -> None:
    """The text that it replaces stands in the file once; the tests that it names are there."""
    assert (ROOT / fault.file).read_text(encoding="utf-8").count(fault.old) == 1
    assert fault.new != fault.old
    assert fault.tests
    for test in fault.tests:
        assert (ROOT / test.partition("::")[0]).exists(), test


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    return Copy(tmp_path_factory.mktemp("mutants") / "openpanto")


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS, ids=[fault.key for fault in FAULTS])
def test_a_fault_makes_a_test_near_it_fail(copy: Copy, fault: Fault) -> None:
    caught, said = copy.catches(fault)
    assert caught, f"{fault.key} survives {' '.join(fault.tests)}:\n{said}"
