"""Which variables belong to which contact of pantograph and wire: found from the connections."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from master.system.connections import Connection

_END: Final = re.compile(r"[AB]\.v?[xyz]")
_FORCE: Final = re.compile(r"(?:pantograph\[(\d+)\]\.)?contact\.force")


@dataclass(frozen=True)
class Contact:
    """One pantograph on the line.

    Attributes
    ----------
    index : int
        1, 2, ... in the order of the catenary's ports.
    catenary, pantograph : str
        Component names.
    prefix : str
        Of the catenary's variables of this contact, e.g. ``catenary.pantograph[1].contact``.
    told : str
        Name of the input that the pantograph is told the force by.
    ends : dict
        Names of the outputs that the catenary is told the strip's ends from, by ``A.x`` ... ``B.vz``.
    """

    index: int
    catenary: str
    pantograph: str
    prefix: str
    told: str = field(default="", compare=False)
    ends: dict[str, str] = field(default_factory=dict, compare=False)

    @property
    def force(self) -> str:
        """Name of the recorded contact force."""
        return f"{self.prefix}.force"

    def point(self, axis: str) -> str:
        """Name of the recorded contact point's coordinate."""
        return f"{self.prefix}.{axis}"

    def end(self, end: str, axis: str) -> str:
        """Name of a coordinate (x, y, z, vx, vy, vz) of the strip's end A or B."""
        return self.ends.get(f"{end}.{axis}", f"{self.pantograph}.{end}.{axis}")

    @property
    def force_input(self) -> str:
        """Name of the input that the pantograph is told the force by."""
        return self.told or f"{self.pantograph}.contact.force"


def find_contacts(connections: Iterable[Connection]) -> tuple[Contact, ...]:
    """Return the contacts: a ``contact.force`` told to an input of that name, or to whoever the strip comes from."""
    known = tuple(connections)
    found: dict[str, Contact] = {}
    for c in known:
        if (match := _FORCE.fullmatch(c.output)) is None:
            continue
        prefix = f"{c.source}.{c.output.removesuffix('.force')}"
        strip = _strip(known, c.source, c.output.removesuffix("contact.force"))
        named_so = c.input.endswith("contact.force")
        if named_so or (prefix not in found and c.target in {s.source for s in strip.values()}):
            ends = {key: f"{s.source}.{s.output}" for key, s in strip.items()}
            contact = Contact(int(match[1] or 1), c.source, c.target, prefix, f"{c.target}.{c.input}", ends)
            found[prefix] = contact
    return tuple(sorted(found.values(), key=lambda x: (x.catenary, x.index)))


def _strip(connections: Iterable[Connection], catenary: str, port: str) -> dict[str, Connection]:
    """Return the connections that tell a port of a catenary its strip, by ``A.x`` ... ``B.vz``."""
    ends = {c.input.removeprefix(port): c for c in connections if c.target == catenary and c.input.startswith(port)}
    return {key: c for key, c in ends.items() if _END.fullmatch(key)}
