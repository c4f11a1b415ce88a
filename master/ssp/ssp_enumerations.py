"""Enumerations that a system structure description or a parameter set declares."""

from __future__ import annotations

from typing import Any

from master.ssp.ssp_xml import SSC, Reader, children

#: Values of the items of an enumeration, by their names.
Items = dict[str, int]


def parse_enumerations(node: Any | None, reader: Reader) -> dict[str, Items]:
    """Parse a list of ``ssc:Enumeration`` (inside ``ssd:Enumerations`` or ``ssv:Enumerations``), by their names."""
    nodes = list(children(node, SSC, "Enumeration"))
    reader.unique(nodes, "enumeration")
    return {reader.text(n, "name"): _items(n, reader) for n in nodes}


def _items(node: Any, reader: Reader) -> Items:
    items = list(children(node, SSC, "Item"))
    reader.unique(items, f"enumeration '{reader.text(node, 'name')}': item")
    return {reader.text(i, "name"): value for i in items if (value := whole(reader.text(i, "value"))) is not None}


def whole(text: str) -> int | None:
    """Return a whole number as XML writes it, None if it is none (the schema check then says so)."""
    digits = text.strip()
    bare = digits[1:] if digits[:1] in ("+", "-") else digits
    return int(digits) if bare.isascii() and bare.isdigit() and len(bare) <= _MOST_DIGITS else None


_MOST_DIGITS = 18
