"""Which variables of an FMU are a strip's ends and the contact force: by their names, or as the user says."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final, Literal, NamedTuple

from master.errors import RequestError, hint
from master.system.components import Fmu, Variable

Side = Literal["line", "pantograph"]
#: What a pantograph gives the line, and what the line gives back.
ENDS: Final = tuple(f"{end}.{kind}{axis}" for end in "AB" for kind in ("", "v") for axis in "xyz")
REPLY: Final = ("contact.force", "contact.x", "contact.y", "contact.z")
#: A variable's name: what stands before, and which of `ENDS` or `REPLY` it is.
_NAME: Final = re.compile(
    r"(?P<prefix>(?:.*[._\]])?)(?:(?P<end>A|B|left|right)[._]?(?P<axis>v?[xyz])|contact[._]?(?P<reply>force|[xyz]))",
    re.IGNORECASE,
)
_NUMBER: Final = re.compile(r"\d+")
_LETTERS: Final = {"a": "A", "left": "A", "b": "B", "right": "B"}


class PortVariable(NamedTuple):
    """A variable that takes part in the coupling."""

    name: str
    unit: str


Port = Mapping[str, PortVariable]


def own_port(prefix: str = "") -> Port:
    """Return the port of a pantograph of ours, or with its prefix that of a line."""
    units = {name: "m/s" if ".v" in name else "m" for name in (*ENDS, *REPLY)} | {"contact.force": "N"}
    return {name: PortVariable(prefix + name, unit) for name, unit in units.items()}


def find_ports(fmu: Fmu, side: Side, count: int = 1, given: Mapping[tuple[int, str], str] | None = None) -> list[Port]:
    """Return the ports of an FMU from elsewhere, one for a pantograph and ``count`` of a line.

    Parameters
    ----------
    fmu : Fmu
    side : {"line", "pantograph"}
    count : int
        Ports that are needed.
    given : mapping, optional
        Number of the port from 0, and name in `ENDS` or `REPLY` -> variable, as the user says.

    Raises
    ------
    RequestError
        If the variables are not there, or there are several to choose from.
    """
    file, given = fmu.path.name, given or {}
    kinds = ("input", "output") if side == "line" else ("output", "input")
    found: list[Port] = []
    candidates = [_by_prefix(fmu, names, kind) for names, kind in zip((ENDS, REPLY), kinds, strict=True)]
    if side == "pantograph":
        candidates[1] = candidates[1] or _only_input(fmu)
    for number in range(count):
        port: dict[str, PortVariable] = {}
        for names, kind, groups in zip((ENDS, REPLY), kinds, candidates, strict=True):
            said = {name: _said(fmu, kind, name, given[number, name]) for name in names if (number, name) in given}
            if len(groups) > count and not said:
                raise RequestError(_several(file, names, [next(iter(g.values())).name for g in groups]))
            port |= (groups[number] if number < len(groups) else {}) | said
        if lacking := [name for name in _needed(side) if name not in port]:
            raise RequestError(_unfound(file, side, lacking, count, number))
        found.append(port)
    return found


def check_given(names: Iterable[str]) -> None:
    """Refuse names that are in neither `ENDS` nor `REPLY`."""
    for name in names:
        if name not in (*ENDS, *REPLY):
            raise RequestError(f"--map {name}=...: '{name}' is no part of a port; known: {', '.join((*ENDS, *REPLY))}")


def _needed(side: Side) -> tuple[str, ...]:
    # A line says itself what it wants of a strip; without height and force there is no contact.
    return (*ENDS, REPLY[0]) if side == "pantograph" else ("A.z", REPLY[0])


def _by_prefix(fmu: Fmu, names: Sequence[str], causality: str) -> list[dict[str, PortVariable]]:
    """Return the variables of these names, grouped by what stands before them, in the order of its numbers."""
    groups: dict[str, dict[str, PortVariable]] = {}
    for variable in fmu.variables.values():
        match = _NAME.fullmatch(variable.name)
        if match is None or variable.causality != causality or variable.type != "Real":
            continue
        if match["end"]:
            name = f"{_LETTERS[match['end'].lower()]}.{match['axis'].lower()}"
        else:
            name = f"contact.{match['reply'].lower()}"
        if name in names:
            groups.setdefault(match["prefix"], {})[name] = _port_variable(variable)
    return [groups[prefix] for prefix in sorted(groups, key=lambda p: ([int(n) for n in _NUMBER.findall(p)], p))]


def _only_input(fmu: Fmu) -> list[dict[str, PortVariable]]:
    """Return a pantograph's only real input: what else but the force is it for?"""
    inputs = [v for v in fmu.variables.values() if v.causality == "input" and v.type == "Real"]
    return [{REPLY[0]: _port_variable(inputs[0])}] if len(inputs) == 1 else []


def _said(fmu: Fmu, causality: str, name: str, wanted: str) -> PortVariable:
    known = [v.name for v in fmu.variables.values() if v.causality == causality and v.type == "Real"]
    if wanted in known:
        return _port_variable(fmu.variables[wanted])
    others = hint(wanted, known) or f"; it has {', '.join(known[:16]) or 'none'}"
    raise RequestError(f"--map {name}={wanted}: {fmu.path.name} has no real {causality} '{wanted}'{others}")


def _port_variable(variable: Variable) -> PortVariable:
    return PortVariable(variable.name, variable.unit)


def _several(file: str, names: Sequence[str], examples: Sequence[str]) -> str:
    listed = ", ".join(examples[:4])
    return f"{file} has several variables that could be {names[0]} ({listed}): say which by --map {names[0]}=NAME ..."


def _unfound(file: str, side: Side, lacking: Sequence[str], count: int, number: int) -> str:
    listed = f"{', '.join(lacking[:4])}{' ...' if len(lacking) > 4 else ''}"
    port = f" at port {number + 1} of {count}" if count > 1 else ""
    name = f"pantograph[{number + 1}].{lacking[0]}" if count > 1 else lacking[0]
    text = f"{file}: no variable is named as a {side}'s {listed}{port}: say which it is by --map {name}=NAME"
    return f"{text}, and so on" if len(lacking) > 1 else text
