"""Units: as declared in SSP and FMI files, and the conversion between compatible ones."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from master.ssp.ssp_xml import SSC, Reader, child, children

#: Exponents of kg, m, s, A, K, mol, cd, rad.
Dimension = tuple[int, int, int, int, int, int, int, int]
#: Relative difference that rounding explains (0.27778 for 1/3.6).
_DIGITS: Final = 1e-5
BASE_UNITS: Final = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class Unit:
    """A unit: value in base units = factor * value + offset; ``file`` and ``line`` say where it is declared."""

    name: str
    dimension: Dimension
    factor: float = 1.0
    offset: float = 0.0
    file: str = field(default="", compare=False)
    line: int = field(default=0, compare=False)


@dataclass(frozen=True)
class Conversion:
    """The map factor * value + offset from one unit to another."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, value: float) -> float:
        """Convert a value."""
        return self.factor * value + self.offset

    def then(self, other: Conversion) -> Conversion:
        """Return the conversion that applies this one and then ``other``."""
        return Conversion(other.factor * self.factor, other.factor * self.offset + other.offset)

    @property
    def is_identity(self) -> bool:
        """Whether values pass unchanged."""
        return self.factor == 1.0 and self.offset == 0.0


def _unit(name: str, factor: float = 1.0, offset: float = 0.0, **powers: int) -> Unit:
    dimension = [powers.get(base, 0) for base in BASE_UNITS]
    return Unit(name, tuple(dimension), factor, offset)  # type: ignore[arg-type]


#: Units known without a declaration; a file's own declaration of the same name takes precedence.
COMMON: Final = {
    u.name: u
    for u in (
        _unit("1"),
        _unit("%", 0.01),
        _unit("m", m=1),
        _unit("mm", 1e-3, m=1),
        _unit("cm", 1e-2, m=1),
        _unit("km", 1e3, m=1),
        _unit("m2", m=2),
        _unit("cm2", 1e-4, m=2),
        _unit("mm2", 1e-6, m=2),
        _unit("m4", m=4),
        _unit("mm4", 1e-12, m=4),
        _unit("s", s=1),
        _unit("ms", 1e-3, s=1),
        _unit("Hz", s=-1),
        _unit("1/s", s=-1),
        _unit("m/s", m=1, s=-1),
        _unit("mm/s", 1e-3, m=1, s=-1),
        _unit("km/h", 1 / 3.6, m=1, s=-1),
        _unit("m/s2", m=1, s=-2),
        _unit("kg", kg=1),
        _unit("kg/m", kg=1, m=-1),
        _unit("kg/m3", kg=1, m=-3),
        _unit("N", kg=1, m=1, s=-2),
        _unit("daN", 10.0, kg=1, m=1, s=-2),
        _unit("kN", 1e3, kg=1, m=1, s=-2),
        _unit("N.m", kg=1, m=2, s=-2),
        _unit("kN.m", 1e3, kg=1, m=2, s=-2),
        _unit("N/m", kg=1, s=-2),
        _unit("daN/m", 10.0, kg=1, s=-2),
        _unit("kN/m", 1e3, kg=1, s=-2),
        _unit("N/mm", 1e3, kg=1, s=-2),
        _unit("N.s/m", kg=1, s=-1),
        _unit("N.s2/m2", kg=1, m=-1),
        _unit("N.m2", kg=1, m=3, s=-2),
        _unit("Pa", kg=1, m=-1, s=-2),
        _unit("MPa", 1e6, kg=1, m=-1, s=-2),
        _unit("GPa", 1e9, kg=1, m=-1, s=-2),
        _unit("kg.m2", kg=1, m=2),
        _unit("W", kg=1, m=2, s=-3),
        _unit("J", kg=1, m=2, s=-2),
        _unit("rad", rad=1),
        _unit("deg", math.pi / 180, rad=1),
        _unit("rad/s", rad=1, s=-1),
        _unit("1/m", m=-1),
        _unit("1/K", K=-1),
        _unit("K", K=1),
        _unit("degC", 1.0, 273.15, K=1),
    )
}


#: A number, as Python writes it, and a unit or none.
_QUANTITY: Final = re.compile(
    r"\s*([+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|nan|inf))\s*(\S*)\s*", re.ASCII | re.IGNORECASE
)


#: What looks like a decimal comma.
_COMMA: Final = re.compile(r"\d,\d", re.ASCII)


def split_quantity(text: str) -> tuple[float | None, str]:
    """Return the number in a text such as ``12 kN``, None if there is none, and its unit, empty if it has none.

    Examples
    --------
    >>> split_quantity("12 kN"), split_quantity("-.5"), split_quantity("300km/h")
    ((12.0, 'kN'), (-0.5, ''), (300.0, 'km/h'))
    >>> split_quantity("much")
    (None, '')
    """
    match = _QUANTITY.fullmatch(text)
    return (None, "") if match is None else (float(match[1]), match[2])


def number_advice(text: str) -> str:
    """Return what to do with a text that is not a number but nearly one, empty if it is far from it.

    Examples
    --------
    >>> number_advice("1,5"), number_advice("10s"), number_advice("soon")
    ('; write a decimal point', '; write it without its unit', '')
    """
    if _COMMA.search(text):
        return "; write a decimal point"
    return "; write it without its unit" if split_quantity(text)[1] else ""


def parse_units(node: Any | None, reader: Reader) -> dict[str, Unit]:
    """Parse a list of ``ssc:Unit`` (inside ``ssd:Units`` or ``ssv:Units``)."""
    nodes = list(children(node, SSC, "Unit"))
    reader.unique(nodes, "unit")
    return {u.name: u for u in (parse_unit(n, reader) for n in nodes)}


def parse_unit(node: Any, reader: Reader) -> Unit:
    """Parse ``ssc:Unit``."""
    base = child(node, SSC, "BaseUnit")
    name, line = reader.text(node, "name"), int(node.sourceline or 0)
    if base is None:
        return Unit(name, (0,) * 8, file=reader.file, line=line)
    powers = tuple(_power(base, b, reader) for b in BASE_UNITS)
    factor = reader.number(base, "factor", 1.0)
    if factor == 0.0:
        reader.problem(base, "unit", f"unit '{name}': factor='0' would make every value 0")
        factor = 1.0
    offset = reader.number(base, "offset", 0.0)
    return Unit(name, powers, factor, offset, reader.file, line)  # type: ignore[arg-type]


def contradictions(declared: Iterable[Unit]) -> Iterator[tuple[Unit, str]]:
    """Yield units that an earlier declaration or common usage defines differently, and how.

    Of a unit that everybody knows only factor and offset are compared: whether angles have a dimension is a matter
    of taste, and so is whether a percentage is a hundredth.
    """
    first: dict[str, Unit] = {}
    for unit in declared:
        other = first.setdefault(unit.name, unit)
        where = f"{other.file}, line {other.line}" if other.line else other.file
        if other.dimension != unit.dimension and other.line:  # many tools give no more of an FMU's unit than its name
            yield unit, f"measures something else in {where}"
        elif other.dimension == unit.dimension and not _agree(other, unit):
            yield unit, f"is declared with {_scale(unit)} here, with {_scale(other)} in {where}"
        elif text := unusual(unit):
            yield unit, text


def unusual(unit: Unit) -> str:
    """Return how a common unit is declared differently, empty if it is not."""
    usual = COMMON.get(unit.name)
    if usual is None or unit.name == "%":
        return ""
    if any(unit.dimension) and usual.dimension[:-1] != unit.dimension[:-1]:  # but for angles
        return "is declared to measure something else than everywhere"
    if usual.dimension == unit.dimension and not _agree(usual, unit):
        return f"is declared with {_scale(unit)}; everywhere else it has {_scale(usual)}"
    return ""


def unlike(unit: Unit, other: Unit) -> str:
    """Return how two FMUs' units of one name differ, empty if they do not; many tools give no more than the name."""
    if unit.dimension[:-1] != other.dimension[:-1]:  # but for angles
        return "measures something else" if any(unit.dimension) and any(other.dimension) else ""
    return (
        ""
        if unit.name == "%" or _agree(unit, other)
        else f"is declared with {_scale(unit)}, there with {_scale(other)}"
    )


def _agree(one: Unit, other: Unit) -> bool:
    """Whether two declarations of a unit mean the same, up to the digits that were written."""
    near = math.isclose(one.factor, other.factor, rel_tol=_DIGITS)
    return near and math.isclose(one.offset, other.offset, rel_tol=_DIGITS, abs_tol=_DIGITS)


def _scale(unit: Unit) -> str:
    return f"factor {unit.factor:g}" + (f" and offset {unit.offset:g}" if unit.offset else "")


def conversion(source: Unit, target: Unit) -> Conversion | None:
    """Return the conversion from ``source`` to ``target``, None if they measure different things.

    Examples
    --------
    >>> round(conversion(COMMON["km/h"], COMMON["m/s"])(36.0), 12)
    10.0
    >>> conversion(COMMON["N"], COMMON["m"]) is None
    True
    """
    if source.dimension != target.dimension:
        return None
    if source.factor == target.factor and source.offset == target.offset:
        return Conversion()
    return Conversion(source.factor / target.factor, (source.offset - target.offset) / target.factor)


def _power(node: Any, name: str, reader: Reader) -> int:
    value = reader.number(node, name, 0.0)
    return int(value) if value == value else 0
