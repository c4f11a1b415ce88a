"""The model description: what pythonfmu writes, completed with all that it leaves out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any, Final
from xml.etree.ElementTree import Element, SubElement

from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Causality, Fmi2Initial, Fmi2Variability
from pythonfmu.variables import Integer, Real, ScalarVariable

from fmus.slave.ports import Signal, Table, Variable

#: A fixed date: the same source must give the same FMU.
DATE: Final = "1980-01-01T00:00:00Z"
STEP_SIZE: Final = 1e-3
#: What tools do by default; the models keep their own steps and know no tolerance.
STOP_TIME: Final = 1.0
TOLERANCE: Final = 1e-6
_VARIABILITY: Final = {
    "parameter": (Fmi2Variability.fixed, Fmi2Initial.exact),
    "calculatedParameter": (Fmi2Variability.fixed, Fmi2Initial.calculated),
    "input": (Fmi2Variability.continuous, None),
    "output": (Fmi2Variability.continuous, Fmi2Initial.calculated),
    "local": (Fmi2Variability.continuous, Fmi2Initial.calculated),
}
#: Exponents of derived units over the base units.
_DERIVED: Final[dict[str, dict[str, int]]] = {
    "kg": {"kg": 1},
    "m": {"m": 1},
    "s": {"s": 1},
    "rad": {"rad": 1},
    "K": {"K": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Hz": {"s": -1},
    "1": {},
}
_CAPABILITIES: Final = {
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "canInterpolateInputs": "false",
    "canHandleVariableCommunicationStepSize": "true",
}
_BASE_ORDER: Final = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def describe(slave: Any, table: Table, base: Callable[[dict[str, str]], Element]) -> Element:
    """Return the complete model description of a slave.

    Parameters
    ----------
    slave : pythonfmu.Fmi2Slave
        Gets its variables registered, in the table's order.
    table : Table
    base : callable
        pythonfmu's own ``to_xml``, with the capabilities as argument.
    """
    slave.default_experiment = DefaultExperiment(
        start_time=0.0, stop_time=STOP_TIME, step_size=STEP_SIZE, tolerance=TOLERANCE
    )
    for variable in table.variables:
        slave.register_variable(_pythonfmu_variable(variable), nested=False)
    root = base(_CAPABILITIES)
    root.set("generationDateAndTime", DATE)
    _complete_variables(root, table.variables)
    _insert_units(root, sorted({v.signal.unit for v in table.variables if not v.signal.is_integer}))
    _complete_structure(root, table.variables)
    return root


def base_unit(unit: str) -> dict[str, int]:
    """Return the exponents of a unit over the SI base units.

    Raises
    ------
    ValueError
        If a part of the unit is unknown.

    Examples
    --------
    >>> base_unit("N.s/m")
    {'kg': 1, 's': -1}
    >>> base_unit("m/s2")
    {'m': 1, 's': -2}
    """
    exponents: dict[str, int] = {}
    above, *below = unit.split("/")
    for sign, part in [(1, above), *((-1, p) for p in below)]:
        for factor in part.split("."):
            _add_factor(exponents, factor, sign, unit)
    return {name: exponents[name] for name in _BASE_ORDER if exponents.get(name)}


def _add_factor(exponents: dict[str, int], factor: str, sign: int, unit: str) -> None:
    match = re.fullmatch(r"([A-Za-z]+)(\d*)|1", factor)
    symbol = (match and match[1]) or "1"
    if match is None or symbol not in _DERIVED:
        raise ValueError(f"unit '{unit}' has no known base units ('{factor}')")
    power = sign * int(match[2] or 1)
    for name, exponent in _DERIVED[symbol].items():
        exponents[name] = exponents.get(name, 0) + power * exponent


def _pythonfmu_variable(variable: Variable) -> ScalarVariable:
    variability, initial = _VARIABILITY[variable.causality]
    kind = Integer if variable.signal.is_integer else Real
    return kind(
        variable.signal.name,
        causality=Fmi2Causality[variable.causality],
        variability=variability,
        initial=initial,
        description=variable.signal.description,
    )


def _complete_variables(root: Element, variables: Iterable[Variable]) -> None:
    elements = root.findall("ModelVariables/ScalarVariable")
    for element, variable in zip(elements, variables, strict=True):
        _complete_type(element[0], variable.signal)


def _complete_type(element: Element, signal: Signal) -> None:
    if not signal.is_integer:
        element.set("unit", signal.unit)
    for name, value in (("min", signal.minimum), ("max", signal.maximum), ("start", signal.start)):
        if value is not None:
            # pythonfmu writes 16 digits: one too few to read the same number back.
            element.set(name, str(int(value)) if signal.is_integer else repr(float(value)))


def _insert_units(root: Element, units: Iterable[str]) -> None:
    definitions = Element("UnitDefinitions")
    for unit in units:
        exponents = {name: str(power) for name, power in base_unit(unit).items()}
        SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", exponents)
    if len(definitions):
        position = [child.tag for child in root].index("CoSimulation") + 1
        root.insert(position, definitions)


def _complete_structure(root: Element, variables: Iterable[Variable]) -> None:
    structure = root.find("ModelStructure")
    assert structure is not None  # pythonfmu always writes it
    for unknown in structure.findall("Outputs/Unknown"):
        # While stepping, an output follows from inputs of the step before: no algebraic loop.
        unknown.set("dependencies", "")
    wanted = [i for i, v in enumerate(variables, 1) if v.causality in ("output", "calculatedParameter")]
    if wanted:
        initial = SubElement(structure, "InitialUnknowns")
        for index in wanted:
            SubElement(initial, "Unknown", index=str(index))
