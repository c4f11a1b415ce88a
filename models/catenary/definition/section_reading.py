"""Reading a section of a line: spans, droppers, supports and stagger, the ends of the wires or the ring they form."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from models.catenary.definition.as_built_reading import read_length_errors
from models.catenary.definition.section_definition import EndSpans, Section, Span, Support
from models.catenary.definition.support_reading import listed_stagger, with_own_values
from models.definition_files.toml_reader import Table

#: Tables of a section.
SECTION_TABLES: Final = ("spans", "stagger", "ends", "measured", "supports", "as_built")
#: Largest numbers of spans in a section, of droppers in a span and of droppers in a section.
MAX_SPANS, MAX_HUNG, MAX_DROPPERS = 10_000, 1000, 100_000


@dataclass(frozen=True)
class _Hung:
    """Droppers or hangers of one span: offsets from its start, lengths if they are given [m]."""

    offsets: tuple[float, ...] = ()
    lengths: tuple[float, ...] = ()


def read_section(table: Table, *, has_arms: bool, has_hangers: bool) -> Section:
    """Read the spans of a section, their droppers, the supports, and the ends unless it is a ring."""
    spans_table = table.required_table("spans")
    boundaries = _read_boundaries(spans_table)
    droppers = _read_hung(spans_table, boundaries, "droppers", "listed")
    hangers = [_Hung()] * len(droppers)
    if has_hangers:
        hangers = _read_hung(spans_table, boundaries, "hangers", "listed_hangers")
    periodic = spans_table.flag("periodic", default=False)
    own = table.table("supports")
    if periodic:
        ends, supports = _read_ring(table, boundaries, own, has_arms=has_arms)
    else:
        free, ends = _read_ends(table.required_table("ends"), boundaries)
        supports = _read_supports(table, boundaries, free, own, has_arms=has_arms)
    if own is not None:
        supports = with_own_values(own, supports, periodic=periodic, has_arms=has_arms)
    spans = tuple(_span(a, b, d, h) for (a, b), d, h in zip(pairwise(boundaries), droppers, hangers, strict=True))
    measured = _read_measured(table, boundaries)
    if measured and own is not None and own.has("contact_wire_height"):
        own.problem("contact_wire_height", "gives the contact wire's heights, and so does [measured]: give one of them")
    if measured and any(s.dropper_lengths for s in spans):
        table.problem("measured", "gives the contact wire's profile, and so do the droppers' lengths: give one of them")
    if periodic and measured and abs(measured[-1][1] - measured[0][1]) > 1e-6:
        text = f"a periodic line ends as it begins: the last height must be the first, {measured[0][1]:g} m"
        table.problem("measured.heights", f"{text}, not {measured[-1][1]:g} m")
    return Section(supports, spans, ends, measured, periodic, read_length_errors(table, spans))


def _span(start: float, end: float, droppers: _Hung, hangers: _Hung) -> Span:
    return Span(
        start,
        end,
        droppers=tuple(start + x for x in droppers.offsets),
        hangers=tuple(start + x for x in hangers.offsets),
        dropper_lengths=droppers.lengths,
        hanger_lengths=hangers.lengths,
    )


def _read_boundaries(table: Table) -> list[float]:
    start = table.quantity("start", "m", minimum=-1e7, maximum=1e7)
    if table.has("length"):
        length = table.quantity("length", "m", minimum=1.0, maximum=200.0)
        lengths = [length] * table.integer("count", minimum=1, maximum=MAX_SPANS)
    else:
        lengths = list(table.quantities("lengths", "m", minimum=1.0, maximum=200.0))
        if table.has("lengths") and not table.mistaken(["lengths"]) and not 1 <= len(lengths) <= MAX_SPANS:
            table.problem("lengths", f"gives {len(lengths)} spans, not 1 ... {MAX_SPANS}")
    boundaries = [start]
    for length in lengths or [math.nan]:
        boundaries.append(round(boundaries[-1] + length, 9))
    if table.has("end"):
        end = table.quantity("end", "m")
        if abs(end - boundaries[-1]) > 1e-6:
            sums = f"they end at {boundaries[-1]:g} m, not at {end:g} m"
            advice = table.comma_advice("lengths")
            table.problem("end", f"the spans do not add up: {sums}; correct their lengths or this end{advice}")
    return boundaries


def _read_hung(table: Table, boundaries: Sequence[float], rule_name: str, list_name: str) -> list[_Hung]:
    """Read droppers (or hangers) of every span: by the rule, or as listed for the span."""
    count = len(boundaries) - 1
    listed = _read_listed(table, count, list_name)
    rule = table.table(rule_name)
    if rule is None and len(listed) < count:
        table.problem(rule_name, f"a table [{table.key(rule_name)}] is missing, and not every span lists its own")
    result: list[_Hung] = []
    total = 0
    for index, (a, b) in enumerate(pairwise(boundaries), 1):
        own = listed.get(index, rule)
        result.append(_hung(own, index, b - a) if own is not None else _Hung())
        total += len(result[-1].offsets)
        if total > MAX_DROPPERS:
            table.problem(rule_name, f"the first {index} spans have more than {MAX_DROPPERS} droppers already")
            return [_Hung()] * count
    return result


def _read_listed(table: Table, count: int, list_name: str) -> dict[int, Table]:
    listed: dict[int, Table] = {}
    for entry in table.tables(list_name):
        first = entry.integer("span", minimum=1)
        last = entry.integer("to", default=first, minimum=first)
        if last > count:
            entry.problem("span", f"there is no span {last}: the line has {count}")
        if repeated := [i for i in range(first, min(last, count) + 1) if i in listed]:
            entry.problem("span", f"span {repeated[0]} is listed twice")
        if last > count or repeated:
            _hung(entry, first, math.nan)
        else:
            listed |= dict.fromkeys(range(first, last + 1), entry)
    return listed


def _hung(table: Table, index: int, length: float) -> _Hung:
    """Read positions and given lengths of a span's droppers; ``length`` is that of the span, NaN if unknown [m]."""
    given = table.has("positions")
    offsets = table.quantities("positions", "m") if given else _dropper_rule(table, length)
    _check_droppers(table, index, length, offsets)
    lengths = table.quantities("lengths", "m", default=(), minimum=1e-3, maximum=10.0)
    if len(lengths) == 1:
        lengths = lengths * len(offsets)
    if lengths and len(lengths) != len(offsets):
        text = f"gives {len(lengths)} lengths for the {len(offsets)} droppers of span {index}"
        table.problem("lengths", f"{text}: give one for each, or one for all")
        lengths = ()
    return _Hung(offsets, lengths)


def _dropper_rule(table: Table, length: float) -> tuple[float, ...]:
    first = table.quantity("first", "m", positive=True)
    if table.has("spacing"):
        spacing = table.quantity("spacing", "m", positive=True)
        number = _fitting_number(table, length, first, spacing)
    else:
        number = table.integer("count", minimum=2, maximum=MAX_HUNG)
        spacing = (length - 2.0 * first) / (number - 1)
    return tuple(first + i * spacing for i in range(number))


def _fitting_number(table: Table, length: float, first: float, spacing: float) -> int:
    """Return how many droppers fill a span; if they do not fit, report it and return 0."""
    gaps = (length - 2.0 * first) / spacing if spacing else math.nan
    if not math.isfinite(gaps):
        return 0
    if gaps < 0.0 or abs(gaps - round(gaps)) > 1e-6:
        text = f"droppers from {first:g} m every {spacing:g} m do not fit a span of {length:g} m"
        table.problem("spacing", text)
        return 0
    if gaps >= MAX_HUNG:
        table.problem("spacing", f"{spacing:g} m: makes more than {MAX_HUNG} droppers in a span of {length:g} m")
        return 0
    return round(gaps) + 1


def _check_droppers(table: Table, index: int, length: float, offsets: Sequence[float]) -> None:
    if not (length > 0.0 and all(map(math.isfinite, offsets))):
        return  # already reported
    key = "positions" if table.has("positions") else "first"
    outside = [f"{x:g}" for x in offsets if not 0.0 < x < length]
    if outside:
        table.problem(key, f"dropper at {', '.join(outside)} m lies outside its span, number {index} of {length:g} m")
    elif any(b - a < 1e-3 for a, b in pairwise(offsets)):
        advice = table.comma_advice("positions")
        table.problem(key, f"span {index}: droppers are not in rising order{advice}")


@dataclass(frozen=True)
class _End:
    """One end of a section: number of unregistered spans, where the wires leave the working height, their rise [m]."""

    free: int
    working: float
    rise: float


def _read_ends(table: Table, boundaries: Sequence[float]) -> tuple[tuple[int, int], EndSpans]:
    """Return how many spans at each end are unregistered, and the wires' rise; each end may have its own table."""
    start = _read_end(table.table("start") or table, boundaries)
    end = _read_end(table.table("end") or table, boundaries[::-1])
    anchors = boundaries[0], boundaries[-1]
    return (start.free, end.free), EndSpans(anchors, (start.working, end.working), (start.rise, end.rise))


def _read_end(table: Table, boundaries: Sequence[float]) -> _End:
    """Read one end; ``boundaries`` are in order from that end."""
    most = max(0, (len(boundaries) - 2) // 2) if all(map(math.isfinite, boundaries)) else MAX_SPANS
    free = table.integer("spans", default=0, minimum=0, maximum=most)
    rise = table.quantity("rise", "m", default=0.0, minimum=0.0, maximum=5.0)
    working = boundaries[min(free, len(boundaries) - 1)]  # fewer only if the lengths could not be read
    if table.has("length"):
        whole = boundaries[-1] - boundaries[0]
        length = table.quantity("length", "m", positive=True, maximum=max(1e-3, 0.5 * abs(whole)))
        working = boundaries[0] + math.copysign(length, whole)
    return _End(free, working, rise)


def _read_ring(
    table: Table, boundaries: Sequence[float], own: Table | None, *, has_arms: bool
) -> tuple[EndSpans, tuple[Support, ...]]:
    """Return the ends of a periodic line, which have no rise, and its supports; the one at the seam is listed once."""
    if table.has("ends"):
        table.problem("ends", "a periodic line has no ends: remove this table")
        _read_ends(table.required_table("ends"), boundaries)
    inner, ends = boundaries[:-1], (boundaries[0], boundaries[-1])
    listed = listed_stagger(own, len(inner))
    stagger = _stagger_table(table, listed)
    if stagger.has("anchor"):
        stagger.problem("anchor", "a periodic line has no anchors: remove this value")
        stagger.quantities("anchor", "m")
    if stagger.has("amplitude") and len(inner) % 2:
        text = f"changes sides at every support, and after {len(inner)} spans the line would close on the other side:"
        stagger.problem("amplitude", f"{text} take an even number of spans, or list the stagger of every support")
    supports = zip(inner, _registered_stagger(stagger, len(inner), listed), strict=True)
    return EndSpans(ends, ends, (0.0, 0.0)), tuple(Support(x, y, has_steady_arm=has_arms) for x, y in supports)


def _read_supports(
    table: Table, boundaries: Sequence[float], free: tuple[int, int], own: Table | None, *, has_arms: bool
) -> tuple[Support, ...]:
    """Return the supports with their stagger: alternating where registered, straight on to the anchors."""
    last = len(boundaries) - 1
    registered = [max(free[0], 1) <= i <= last - max(free[1], 1) for i in range(last + 1)]
    listed = listed_stagger(own, max(0, last - 1))
    staggers = _read_stagger(_stagger_table(table, listed), boundaries, registered, listed)
    return tuple(
        Support(x, y, has_steady_arm=has_arms and ok) for x, y, ok in zip(boundaries, staggers, registered, strict=True)
    )


def _stagger_table(table: Table, own: Sequence[float]) -> Table:
    """Return the table [stagger], which may be absent where the supports have their own, ``own``."""
    if own and not table.has("stagger"):
        return Table.from_dict({})
    return table.required_table("stagger")


def _read_stagger(
    table: Table, boundaries: Sequence[float], registered: Sequence[bool], own: Sequence[float]
) -> list[float]:
    """Return the wire's place at every boundary; ``own`` has that of every one between the anchors, if supports do."""
    inner = [i for i, ok in enumerate(registered) if ok]
    values = dict(zip(inner, _registered_stagger(table, len(inner), [own[i - 1] for i in inner if own]), strict=True))
    values |= dict(enumerate(own, 1))
    first, last = _read_anchors(table)
    known = {0: first, len(boundaries) - 1: last} | values
    held = sorted(known)
    return [_straight(known, held, boundaries, i) for i in range(len(boundaries))]


def _read_anchors(table: Table) -> tuple[float, float]:
    """Return the wire's place at the first and the last anchor, one value for both or one for each [m]."""
    anchors = table.quantities("anchor", "m", default=(0.0,), minimum=-10.0, maximum=10.0)
    if len(anchors) not in (1, 2):
        table.problem("anchor", f"gives {len(anchors)} values: give one for both anchors, or one for each")
        return math.nan, math.nan
    return anchors[0], anchors[-1]


def _registered_stagger(table: Table, count: int, own: Sequence[float]) -> tuple[float, ...]:
    """Return the stagger of the registered supports: their own, listed, or alternating."""
    if own:
        _read_replaced(table, count)
        return tuple(own)
    if table.has("listed"):
        return table.quantities("listed", "m", length=count, minimum=-1.0, maximum=1.0)
    amplitude = table.quantity("amplitude", "m", minimum=0.0, maximum=1.0)
    return tuple(amplitude * (-1.0) ** n for n in range(count))


def _read_replaced(table: Table, count: int) -> None:
    """Read what the supports' own stagger replaces, as far as it is there: it must be right all the same."""
    if table.has("listed"):
        table.quantities("listed", "m", length=count, minimum=-1.0, maximum=1.0)
    else:
        table.quantity("amplitude", "m", default=0.0, minimum=0.0, maximum=1.0)


def _straight(known: Mapping[int, float], held: Sequence[int], x: Sequence[float], i: int) -> float:
    """Interpolate the wire's plan position between the supports that hold it, ``held`` in rising order."""
    if i in known:
        return known[i]
    after = bisect_left(held, i)
    left, right = held[after - 1], held[after]
    share = (x[i] - x[left]) / (x[right] - x[left])
    return known[left] + share * (known[right] - known[left])


def _read_measured(table: Table, boundaries: Sequence[float]) -> tuple[tuple[float, float], ...]:
    measured = table.table("measured")
    if measured is None:
        return ()
    x = measured.quantities("positions", "m")
    z = measured.quantities("heights", "m", length=len(x), minimum=2.0, maximum=10.0)
    if any(b <= a for a, b in pairwise(x)):
        measured.problem("positions", "are not in rising order")
    elif x and (x[0] > boundaries[0] or x[-1] < boundaries[-1]):
        measured.problem("positions", f"must reach from {boundaries[0]:g} m to {boundaries[-1]:g} m")
    return tuple(zip(x, z, strict=True))
