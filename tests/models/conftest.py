"""Small lines and pantographs for the physics' tests."""

import tomllib
from pathlib import Path

import pytest

import models
from models.catenary.definition.fault_definition import FAULT_KINDS, Fault
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.line_reading import read
from models.definition_files.toml_reader import Table
from models.library.catalogue import line_path, load_line, load_lumped
from models.pantograph.lumped.lumped_definition import LumpedDefinition

LIBRARY = Path(models.__file__).parent / "library"


def make_line(
    spans: int | None = 6, alpha: float = 0.0272, length: float = 50.0, **changes: object
) -> CatenaryDefinition:
    """Return a simple line of LN2's wires with spans of 50 m or another length; a change to None takes a table away."""
    source = "test"
    data = {
        "name": "short",
        "type": "simple",
        "profile": {
            "contact_wire_height": [5.08, "m", source],
            "encumbrance": [1.4, "m", source],
            "pre_sag": [0.001, "1", source],
        },
        "spans": {
            "start": [0.0, "m", source],
            "count": spans,
            "length": [length, "m", source],
            "droppers": {"first": [4.5, "m", source], "count": 7},
        },
        "stagger": {"amplitude": [0.2, "m", source]},
        "ends": {"spans": 1, "rise": [0.1, "m", source]},
        "contact_wire": {
            "area": [150, "mm2", source],
            "mass": [1.334, "kg/m", source],
            "youngs_modulus": [120, "GPa", source],
            "tension": [20, "kN", source],
        },
        "messenger_wire": {
            "area": [65.5, "mm2", source],
            "mass": [0.605, "kg/m", source],
            "youngs_modulus": [84.7, "GPa", source],
            "tension": [14, "kN", source],
        },
        "dropper": {
            "area": [12, "mm2", source],
            "mass": [0.11, "kg/m", source],
            "youngs_modulus": [84.7, "GPa", source],
            "slack_law": "elastic_only",  # as LN2 with its damping
        },
        "steady_arm": {
            "area": [120, "mm2", source],
            "mass": [1.07, "kg/m", source],
            "youngs_modulus": [84.7, "GPa", source],
            "length": [1.22, "m", source],
            "angle": [-10, "deg", source],
        },
        "clamps": {
            "dropper_upper": [0.195, "kg", source],
            "dropper_lower": [0.165, "kg", source],
            "steady_arm": [0.2, "kg", source],
        },
        "damping": {"alpha": [alpha, "s", source], "beta": [0.0, "1/s", source]},
    }
    data.update(changes)
    if spans is None:
        del data["spans"]
    return read(Table.from_dict({k: v for k, v in data.items() if v is not None}, "short.toml"))


def shortened(name: str, spans: int | None) -> CatenaryDefinition:
    """Return a line of the library with the first and last of its spans, ``spans`` in all; None for the whole of it.

    Lines of several sections stay whole.
    """
    data = tomllib.loads(line_path(name).read_text(encoding="utf-8"))
    if "spans" not in data:
        return load_line(name)
    table = data["spans"]
    if spans is not None and "lengths" in table:
        lengths = table["lengths"][0]
        table["lengths"][0] = lengths[: (spans + 1) // 2] + lengths[len(lengths) - spans // 2 :]
        table.pop("end", None)
    elif spans is not None:
        table["count"][0] = spans
        table.pop("end", None)
    return read(Table.from_dict(data, name))


def make_fault(kind: str, **values: object) -> Fault:
    """Return a fault of some kind, active unless it is said not to be."""
    return FAULT_KINDS[kind](kind=kind, **values)


def make_section(
    start: float, spans: int, stagger: list[float], *, anchor: float = 0.0, **ends: object
) -> dict[str, object]:
    """Return a section of ``spans`` spans of 50 m from ``start``, its inner supports at the places ``stagger``."""
    source = "test"
    return {
        "spans": {
            "start": [start, "m", source],
            "count": spans,
            "length": [50.0, "m", source],
            "droppers": {"first": [4.5, "m", source], "count": 7},
        },
        "stagger": {"listed": [stagger, "m", source], "anchor": [anchor, "m", source]},
        "ends": {"spans": 1, "rise": [0.1, "m", source]} | ends,
    }


def make_sections(*sections: dict[str, object], **changes: object) -> CatenaryDefinition:
    """Return a line of LN2's wires in several sections."""
    return make_line(spans=None, stagger=None, ends=None, section=list(sections), **changes)


def make_overlap(spans: int = 6) -> CatenaryDefinition:
    """Return a line of LN2's wires in two sections of ``spans`` spans, of which they share two."""
    stagger = [0.2 if i % 2 == 0 else -0.2 for i in range(spans - 1)]
    return make_sections(
        make_section(0.0, spans, stagger), make_section(50.0 * (spans - 2), spans, [-s for s in stagger])
    )


def make_ring(spans: int = 10, stagger: object = None, **changes: object) -> CatenaryDefinition:
    """Return a line of LN2's wires that closes on itself after ``spans`` spans of 50 m."""
    source = "test"
    section = {
        "spans": {
            "start": [0.0, "m", source],
            "count": spans,
            "length": [50.0, "m", source],
            "droppers": {"first": [4.5, "m", source], "count": 7},
            "periodic": True,
        },
        "stagger": stagger or {"amplitude": [0.2, "m", source]},
    }
    return make_sections(section, **changes)


@pytest.fixture(scope="session")
def section_maker():
    return make_section


@pytest.fixture(scope="session")
def sections_maker():
    return make_sections


@pytest.fixture(scope="session")
def ring_maker():
    return make_ring


@pytest.fixture(scope="session")
def short_line() -> CatenaryDefinition:
    return make_line()


@pytest.fixture(scope="session")
def line_maker():
    return make_line


@pytest.fixture(scope="session")
def ln2() -> CatenaryDefinition:
    return load_line("LN2")


@pytest.fixture(scope="session")
def cx() -> LumpedDefinition:
    return load_lumped("CX")
