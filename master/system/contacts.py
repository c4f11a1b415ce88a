"""Which variables belong to which contact of pantograph and wire: found from the connections."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from master.system.connections import Connection

_END: Final = re.compile(r"[AB]\.v?[xyz]")
#: Keys of a contact in ``summary.json`` that differ from its attributes.
_KEYS: Final = {"force_input": "told"}
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
    force_input : str
        Name of the pantograph's input for the force; ``contact.force`` if not given.
    ends : dict
        Names of the outputs that give the catenary the strip's ends, by ``A.x`` ... ``B.vz``.
    """

    index: int
    catenary: str
    pantograph: str
    prefix: str
    force_input: str = field(default="", compare=False)
    ends: dict[str, str] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if not self.force_input:
            object.__setattr__(self, "force_input", f"{self.pantograph}.contact.force")

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

    def as_data(self) -> dict[str, Any]:
        """Return the contact as ``summary.json`` has it, where the input for the force is called ``told``."""
        return {_KEYS.get(name, name): value for name, value in asdict(self).items()}

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Contact:
        """Return the contact that `as_data` was called on."""
        names = {key: name for name, key in _KEYS.items()}
        return cls(**{names.get(key, key): value for key, value in data.items()})


def find_contacts(connections: Iterable[Connection]) -> tuple[Contact, ...]:
    """Return the contacts: where a ``contact.force`` leads to an input of that name, or to the strip's component."""
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
    """Return the connections that give a port of a catenary its strip, by ``A.x`` ... ``B.vz``."""
    ends = {c.input.removeprefix(port): c for c in connections if c.target == catenary and c.input.startswith(port)}
    return {key: c for key, c in ends.items() if _END.fullmatch(key)}
