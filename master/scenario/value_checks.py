"""Checks of values: what the numbers of a scenario rule out before anything is run.

A stop time that does not cover the interval of interest, a pantograph that starts beyond it or that nothing lifts. The
master knows no physics but what FMUs show: a pantograph whose FMU has the parameters ``speed`` and ``start_position``,
as ours have, is at ``start_position + speed (t - start)``. Of others nothing is said here; what their run has covered
is seen at its end (`master.evaluation.interval_coverage`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from master.system.components import Component, System
from master.system.pantograph_motion import constant_speed, final_position, pantographs, parameter_value
from master.system.step_rounding import ROUNDING

#: How long a run continues after the last pantograph has left the interval [s]: the filter looks that far ahead, and
#: the waves that lift supports leave late.
AFTER_INTERVAL: Final = 0.5
#: Parameters that lift a pantograph, in N or N.m.
_LIFTS: Final = ("static_force", "static_moment")
#: Heights of the strip, which lie between its stops; and these.
_HEIGHTS: Final = ("start_height", "reference_height")
_STOPS: Final = ("lowest_height", "highest_height")
#: Parameters that say where a pantograph is at any time.
_WAY: Final = ("start_position", "speed")


def problems(system: System, may_stop_early: bool = False) -> Iterator[str]:
    """Yield what cannot be intended, a sentence each.

    Parameters
    ----------
    may_stop_early : bool
        Whether the run may end before the interval of interest does, because the user has said so.
    """
    for pantograph in pantographs(system):
        yield from _idle(pantograph)
        if not may_stop_early:
            yield from filter(None, [_uncovered(system, pantograph)])
        if found := beyond_stops(pantograph):
            yield found[1]


def beyond_stops(pantograph: Component) -> tuple[str, str] | None:
    """Return which height of the strip lies beyond its stops, and a sentence on it; None if none does.

    Of a pantograph whose FMU has no parameters ``lowest_height`` and ``highest_height`` nothing is said: how far the
    arms of a mechanism reach follows from all that they are made of, which only its FMU knows.
    """
    low, high = (parameter_value(pantograph, name) for name in _STOPS)
    for name in _HEIGHTS:
        value = parameter_value(pantograph, name)
        if value is None:
            continue
        given = f"{pantograph.name}.{name} = {value:g} m is"
        if low is not None and value < low:
            return name, f"{given} below the lowest_height of {low:g} m{_between(low, high)}"
        if high is not None and value > high:
            return name, f"{given} above the highest_height of {high:g} m{_between(low, high)}"
    return None


def _between(low: float | None, high: float | None) -> str:
    return "" if low is None or high is None else f": between its stops the strip goes from {low:g} to {high:g} m"


def uncovered(system: System) -> str:
    """Return why a run will have no figures, empty if that is not known: it does not cover the interval of interest."""
    return next(filter(None, (_uncovered(system, p, is_meant=True) for p in pantographs(system))), "")


def empty_cells(system: System, names: Sequence[str]) -> str:
    """Return what is wrong with parameters that a table has no value for, empty if they are not the line's.

    A pantograph without values takes no part in a variant; without its line nothing is left to run.
    """
    lines = {c.catenary for c in system.contacts}
    found = [name for name in names if any(name.startswith(f"{line}.") for line in lines)]
    return f"the table has no value for {', '.join(found)}: write one into every row" if found else ""


def half_empty_rows(system: System, empty: Sequence[str], absent: Sequence[str]) -> str:
    """Return what is wrong with a table's row that fills some cells of a pantograph, or none of any pantograph.

    A pantograph without values takes no part; one with some would run with the scenario's values for the others, and
    without any pantograph a run has nothing to show.
    """
    named = [p.name for p in pantographs(system)]
    half = [name for name in empty if name.partition(".")[0] in named and name.partition(".")[0] not in absent]
    if half:
        return f"the table has no value for {', '.join(half)}: write one, or leave all cells of that pantograph empty"
    if named and all(name in absent for name in named):
        return f"the table leaves out every pantograph ({', '.join(named)}): write the values of one of them"
    return ""


def stop_after_interval(system: System) -> float | str:
    """Return the stop time at which the last pantograph has left the interval of interest [s], or why there is none.

    It is a whole number of steps after the start, `AFTER_INTERVAL` after the last pantograph has passed the end.
    """
    end = system.settings.interval.end
    if end is None:
        return "the interval of interest has no end that the run could end at; give it one, or a stop time"
    found = pantographs(system)
    if not found:
        return "no pantograph receives a contact force, so none can pass the interval and end the run; give a stop time"
    times = []
    for pantograph in found:
        start, speed = parameter_value(pantograph, "start_position"), constant_speed(pantograph)
        if start is None or speed is None:
            if parameter_value(pantograph, "speed") is not None and start is not None:
                return f"'{pantograph.name}' moves as its inputs say (use_train = 1); give a stop time"
            absent = " and ".join(n for n in _WAY if parameter_value(pantograph, n) is None)
            text = f"the FMU of '{pantograph.name}' gives no {absent}, so when it leaves the interval is not known"
            return f'{text}; give a stop time (stopTime instead of until="end", or --stop)'
        if speed <= 0.0:
            return f"{pantograph.name}.speed = {speed:g} m/s never leads to the end of the interval, {end:g} m"
        times.append((end - start) / speed)
    steps = math.ceil((max(0.0, *times) + AFTER_INTERVAL) / system.step - ROUNDING)
    return system.start + steps * system.step


def _idle(pantograph: Component) -> Iterator[str]:
    for name in _LIFTS:
        value = parameter_value(pantograph, name)
        if value is not None and value <= 0.0:
            unit = pantograph.fmu.variables[name].unit
            yield f"{pantograph.name}.{name} = {value:g} {unit} never lifts the strip to the wire: give it more than 0"


def _uncovered(system: System, pantograph: Component, *, is_meant: bool = False) -> str:
    """Return what of the interval of interest a pantograph does not pass, empty if nothing; and what to do."""
    interval, last = system.settings.interval, final_position(system, pantograph)
    start, speed = parameter_value(pantograph, "start_position"), constant_speed(pantograph)
    if last is None or start is None or speed is None:
        return ""
    stride = speed * system.step
    if interval.start is not None and start > interval.start + stride:
        return (
            f"'{pantograph.name}' starts at {start:g} m, beyond the start of the interval of interest, "
            f"{interval.start:g} m: give it an earlier start_position, or the interval a later start"
        )
    if interval.end is not None and last < interval.end - stride:
        where = f"'{pantograph.name}' at {last:.6g} m, before the end of the interval of interest, {interval.end:g} m"
        cure = _cure(system, start, speed, interval.end)
        part = "" if is_meant else ", or run a part of it with --stop"
        return f"the run ends at {system.stop:g} s with {where}: {cure}{part}"
    return ""


def _cure(system: System, start: float, speed: float, end: float) -> str:
    if speed <= 0.0:
        return f"its speed is {speed:g} m/s"
    needed = system.start + math.ceil(10.0 * (end - start) / speed) / 10.0
    return f'stop at {needed:g} s or later, or write until="end" into Interval'
