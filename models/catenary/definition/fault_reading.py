"""Reading the tables [[fault]], and checking that the line has what they are of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from models.catenary.definition.fault_definition import FAULT_KINDS, Fault, TensionLoss, Wear
from models.catenary.definition.line_definition import CatenaryDefinition
from models.definition_files import field_schema
from models.definition_files.toml_reader import Table

#: Key -> the kinds that have it; those that all have are left out.
_OWN_KEYS: Final[dict[str, tuple[str, ...]]] = {
    "span": ("dropper_broken", "dropper_slipped"),
    "dropper": ("dropper_broken", "dropper_slipped"),
    "support": ("arm_loose", "support_sunk"),
    "wire": ("tension_loss",),
    "from": ("wear",),
    "to": ("wear",),
    "lost_thickness": ("wear",),
    "position": ("hard_point",),
    "height": ("hard_point",),
    "length": ("hard_point",),
    "value": tuple(kind for kind, cls in FAULT_KINDS.items() if cls.asks),
}
#: Keys that say what a fault is of.
_PLACES: Final = ("section", "span", "dropper", "support", "wire", "from", "to", "position")


def read_faults(tables: Sequence[Table]) -> tuple[Fault, ...]:
    """Return the faults of a line; one whose kind is unknown is left out."""
    return tuple(fault for table in tables if (fault := _read(table)) is not None)


def check_faults(tables: Sequence[Table], definition: CatenaryDefinition) -> None:
    """Check that the line has what every fault is of, and no two are of the same."""
    known = [table for table in tables if table.data.get("kind") in tuple(FAULT_KINDS)]  # it may be anything
    numbers = [number for number, table in enumerate(tables, 1) if table in known]
    seen: dict[tuple[int, str], int] = {}
    for number, table, fault in zip(numbers, known, definition.fault, strict=True):
        key, name = fault.of()
        if table.mistaken(_PLACES):
            continue  # what it is of is not known
        if problem := _missing(definition, fault):
            table.problem(*problem)
        elif (other := seen.setdefault((fault.section, name), number)) != number:
            table.problem(key, f"{name} has a fault already, fault[{other}]")
    _check_wear(known, numbers, definition)


def _read(table: Table) -> Fault | None:
    kind = table.text("kind", choices=FAULT_KINDS)
    if kind not in FAULT_KINDS:
        table.accept_all()  # what the other keys mean depends on the kind
        return None
    for key in table.names():
        if kind not in _OWN_KEYS.get(key, (kind,)):
            table.offers(key)
            table.problem(key, f"means nothing for kind '{kind}', of {', '.join(_OWN_KEYS[key])}: remove it")
    return field_schema.read(FAULT_KINDS[kind], table, kind=kind)


def _missing(definition: CatenaryDefinition, fault: Fault) -> tuple[str, str] | None:
    """Return the key and the text if the line has not what a fault is of."""
    if fault.section > len(definition.sections):
        return "section", f"there is no section {fault.section}: the line has {len(definition.sections)}"
    if isinstance(fault, TensionLoss) and fault.wire == "auxiliary_wire" and definition.auxiliary_wire is None:
        return "wire", "the line has no auxiliary wire"
    return fault.missing_part(definition.sections[fault.section - 1])


def _check_wear(tables: Sequence[Table], numbers: Sequence[int], definition: CatenaryDefinition) -> None:
    """Check that no length of wire is worn twice."""
    worn = [(f, t, n) for f, t, n in zip(definition.fault, tables, numbers, strict=True) if isinstance(f, Wear)]
    for i, (fault, table, _) in enumerate(worn):
        for other, _, number in worn[:i]:
            same = fault.section == other.section and fault.from_ != other.from_
            if same and fault.from_ < other.to and other.from_ < fault.to:
                table.problem("from", f"{fault.from_:g} m: what is worn there is that of fault[{number}] already")
