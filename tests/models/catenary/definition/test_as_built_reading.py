"""The table [as_built]: one error for each dropper of a section, in the order of the track."""

import pytest

from models.definition_files.toml_reader import DefinitionError
from tests.models.conftest import make_line


def errors(values, unit="mm"):
    return {"dropper_length_errors": [values, unit, "test"]}


def test_errors_are_read_in_order_and_in_metres():
    line = make_line(4, as_built=errors([float(k) for k in range(28)]))
    assert line.sections[0].length_errors == pytest.approx([k / 1000.0 for k in range(28)], abs=1e-12)
    assert make_line(4).sections[0].length_errors == ()


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (errors([1.0] * 27), "gives 27 values for 28 droppers: one for each, in the order of the track"),
        (errors([]), "gives 0 values for 28 droppers"),
        (errors([1500.0] * 28), "outside -1 ... 1 m"),
        (errors([1.0] * 28, "N"), "unit 'N'"),
        ({}, "as_built.dropper_length_errors"),
        ({**errors([1.0] * 28), "lengths": 1}, "as_built.lengths"),
    ],
    ids=["too few", "none", "too large", "unit", "missing", "unknown"],
)
def test_wrong_errors_are_told(table, said):
    with pytest.raises(DefinitionError, match=r"short\.toml") as error:
        make_line(4, as_built=table)
    assert said in str(error.value)
