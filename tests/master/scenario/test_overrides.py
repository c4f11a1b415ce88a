"""Values from the command line and from tables of variants, with and without a unit."""

from pathlib import Path

import pytest

from master.errors import RequestError
from master.scenario.overrides import with_values
from master.ssp.ssp_units import COMMON, Unit, split_quantity
from master.system.components import Component, Fmu, Variable
from models.definition_files.si_units import SI

BASES = {"N": "tension", "m/s": "speed", "Pa": "modulus", "m2": "area", "panto": "own", "": "plain", "lost": "odd"}


def variable(name, unit, kind="Real", limits=(None, None)):
    return Variable(name, 0, kind, "parameter", "fixed", unit, "1", *limits)


def component():
    variables = {name: variable(name, unit) for unit, name in BASES.items()}
    variables["count"] = variable("count", "", "Integer")
    variables["few"] = variable("few", "m", limits=(1.0, 2.0))
    units = {"panto": Unit("panto", COMMON["kg"].dimension, 2.0), "half": Unit("half", COMMON["kg"].dimension, 1.0)}
    fmu = Fmu(Path("a.fmu"), "", "", variables, can_restore=True, sha256="", tool="", units=units)
    return Component("a", fmu, {}, (), ())


def taken(name, text):
    (changed,) = with_values((component(),), {f"a.{name}": text})
    return changed.parameters[name]


@pytest.mark.parametrize(
    ("text", "number", "unit"),
    [
        ("12", 12.0, ""),
        (" 12 kN ", 12.0, "kN"),
        ("12kN", 12.0, "kN"),
        ("-.5", -0.5, ""),
        ("+1.e3 m", 1000.0, "m"),
        ("1E-3mm", 1e-3, "mm"),
        ("12 e", 12.0, "e"),
        ("12 k N", None, ""),
        ("kN", None, ""),
        ("1,5", 1.0, ",5"),
        ("1_000", 1.0, "_000"),
        ("0x10", 0.0, "x10"),
        ("", None, ""),
        ("٣", None, ""),
    ],
)
def test_number_and_unit_are_told_apart(text, number, unit):
    assert split_quantity(text) == (number, unit)


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("tension", "12 kN", 12000.0),
        ("tension", "1200 daN", 12000.0),
        ("tension", "12", 12.0),
        ("tension", "12 N", 12.0),
        ("speed", "300 km/h", 300.0 / 3.6),
        ("modulus", "110 GPa", 110e9),
        ("area", "150 mm2", 150e-6),
        ("own", "3 half", 1.5),  # units that the FMU defines
        ("own", "3 kg", 1.5),
        ("own", "3", 3.0),
        ("plain", "3", 3.0),
        ("odd", "3 lost", 3.0),
        ("count", "3", 3),
    ],
)
def test_values_are_given_in_the_unit_of_the_fmu(name, text, value):
    assert taken(name, text) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("tension", "12 kg", "'a.tension' = 12 kg: give it in N, daN, kN"),
        ("tension", "12 kilo", "unit 'kilo' is not known (known: panto, half, 1, %"),
        ("tension", "much", "'much' is not a number, or a number with its unit ('1 N')"),
        ("tension", "1,5", "'1,5' is not a number; write a decimal point"),
        ("tension", "nan", "is not finite"),
        ("plain", "3 m", "give it in no unit: the FMU declares none"),
        ("odd", "3 m", "give it in lost"),
        ("count", "3 m", "'3 m' is not a whole number"),
        ("few", "2500 mm", "= 2.5 m is above its maximum 2; a value without a unit is in m: check its size"),
    ],
)
def test_what_cannot_be_meant_is_told(name, text, said):
    with pytest.raises(RequestError) as error:
        taken(name, text)
    assert said in str(error.value)


def test_units_of_definitions_are_units_of_the_master_too():
    """Of the same size; angles in a denominator are left to the FMU's own declaration."""
    for name, (base, factor) in SI.items():
        if "/rad" not in name:
            assert COMMON[name].factor == pytest.approx(factor * COMMON[base].factor), name
            assert COMMON[name].dimension == COMMON[base].dimension, name
