"""Reading the table [supports]: what single supports have in place of the line-wide value."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, Final

from models.catenary.definition.section_definition import Support
from models.definition_files.toml_reader import Table

#: Key of the table -> unit and range; the field of a support has the same name.
QUANTITIES: Final[dict[str, tuple[str, float, float]]] = {
    "contact_wire_height": ("m", 2.0, 10.0),
    "encumbrance": ("m", 0.05, 5.0),
    "messenger_stagger": ("m", -2.0, 2.0),
    "arm_length": ("m", 0.1, 10.0),
    "arm_angle": ("rad", -1.2, 1.2),
}
_OF_ARMS: Final = ("arm_length", "arm_angle", "arm_side")
#: A side that follows from the force which the support must give.
AUTO: Final = "auto"


def listed_stagger(own: Table | None, count: int) -> tuple[float, ...]:
    """Return the stagger of all supports between the anchors, if the table [supports] gives it [m]; NaN if wrongly."""
    if own is None or not own.has("stagger"):
        return ()
    return _each(own, "stagger", count, "m", -1.0, 1.0) or (math.nan,) * count


def with_own_values(own: Table, supports: Sequence[Support], *, periodic: bool, has_arms: bool) -> tuple[Support, ...]:
    """Return the supports of a section with what its table [supports], ``own``, gives them.

    Anchors have the heights of the supports beside them, from which the wires rise.
    """
    supports = _named(own, supports, periodic=periodic)
    inner = supports if periodic else supports[1:-1]
    for name in (*QUANTITIES, "stagger", "arm_side"):
        own.offers(name)
    columns = {
        name: _each(own, name, len(inner), unit, low, high)
        for name, (unit, low, high) in QUANTITIES.items()
        if own.has(name)
    }
    columns["arm_side"] = _sides(own, len(inner))
    columns = {name: values for name, values in columns.items() if values}
    if not has_arms and (named := [name for name in _OF_ARMS if own.has(name)]):
        own.problem(named[0], "the line has no steady arms: it needs a table [steady_arm]")
    if not set(own.names()) & {*QUANTITIES, "arm_side", "stagger", "structure"}:
        own.problem("", "gives nothing of any support: fill it, or remove it")
    changed = [_changed(s, {name: values[i] for name, values in columns.items()}) for i, s in enumerate(inner)]
    if periodic or not changed:
        return tuple(changed or supports)
    first, last = (_anchor(s, beside) for s, beside in ((supports[0], changed[0]), (supports[-1], changed[-1])))
    return first, *changed, last


def _named(own: Table, supports: Sequence[Support], *, periodic: bool) -> tuple[Support, ...]:
    """Return the supports with the names of their structures, as far as these are given."""
    names = own.texts("structure")
    if not names:
        return tuple(supports)
    inner = len(supports) if periodic else len(supports) - 2
    if len(names) not in (inner, len(supports)):
        also = "" if periodic else f", or {len(supports)} with the anchors"
        own.problem("structure", f'gives {len(names)} names for {inner} supports{also}; an unknown one is ""')
        return tuple(supports)
    known = [name for name in names if name]
    if repeated := next((name for name in known if known.count(name) > 1), ""):
        own.problem("structure", f"'{repeated}' is the name of two supports: names tell them apart")
    if len(names) < len(supports):
        names = ("", *names, "")
    return tuple(dataclasses.replace(s, structure=name) for s, name in zip(supports, names, strict=True))


def _changed(support: Support, values: dict[str, float]) -> Support:
    fields: dict[str, Any] = dict(values)
    if "arm_side" in fields:
        fields["arm_side"] = int(fields["arm_side"])
    return dataclasses.replace(support, **fields)


def _anchor(support: Support, beside: Support) -> Support:
    return dataclasses.replace(support, contact_wire_height=beside.contact_wire_height, encumbrance=beside.encumbrance)


def _each(own: Table, name: str, count: int, unit: str, low: float, high: float) -> tuple[float, ...]:
    """Return one value for each support: as listed, or the same for all; none if they cannot be read."""
    values = own.quantities(name, unit, default=(), minimum=low, maximum=high)
    if len(values) == 1:
        return values * count
    if values and len(values) != count:
        own.problem(name, f"gives {len(values)} values for {count} supports between the anchors: one for each, or one")
        return ()
    if not values and own.has(name) and _is_empty_list(own.data[name]):
        own.problem(name, "gives no value: one for each support between the anchors, or one for all")
    return values


def _is_empty_list(entry: Any) -> bool:
    return isinstance(entry, list) and bool(entry) and entry[0] == []


def _sides(own: Table, count: int) -> tuple[float, ...]:
    if not own.has("arm_side"):
        return ()
    if isinstance(side := own.data["arm_side"], str):
        if own.text("arm_side") != AUTO:
            own.problem("arm_side", f"'{side}': a side is 1, to the left of the wire, or -1, or all of them 'auto'")
        return ()
    sides = _each(own, "arm_side", count, "1", -1.0, 1.0)
    if wrong := [side for side in sides if abs(side) != 1.0]:
        own.problem("arm_side", f"{wrong[0]:g}: a side is 1, to the left of the wire, or -1, or all of them 'auto'")
        return ()
    return sides
