"""Times in seconds that are not a whole number of macro steps: what the run does instead, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from master.ssp.run_settings import Record
from master.system.components import Component, System, Variable
from master.system.variable_names import matcher

#: Causalities of what is recorded besides the exchanged outputs.
MEASURED: Final = ("output", "local")
#: Share of a step by which a time may miss a whole number of steps by rounding.
ROUNDING: Final = 1e-6


def adjustments(system: System, checkpoint_every: float | None = None) -> tuple[str, ...]:
    """Return a sentence for every time that the run cannot meet: its end, rates of recording, checkpoints.

    Examples
    --------
    >>> from master.ssp.run_settings import RunSettings
    >>> adjustments(System("s", (), (), 0.0, 0.5, 0.003, RunSettings()))
    ('the run ends at 0.498 s, not at 0.5 s, which is no whole number of steps of 0.003 s',)
    """
    return tuple(_adjustments(system, checkpoint_every))


def _adjustments(system: System, checkpoint_every: float | None) -> Iterator[str]:
    h = system.step
    end = system.start + system.step_count * h
    if abs(end - system.stop) > ROUNDING * h:
        yield f"the run ends at {end:.9g} s, not at {system.stop:.9g} s, {_no_multiple(h)}"
    for every in sorted({r.every for r in _used(system)}):
        if text := _changed(every, h):
            names = " ".join(dict.fromkeys(v for r in _used(system) if r.every == every for v in r.variables))
            yield f"{names}: recorded every {text}"
    if checkpoint_every is not None and (text := _changed(checkpoint_every, h)):
        yield f"checkpoints are written every {text}"


def _no_multiple(step: float) -> str:
    return f"which is no whole number of steps of {step:g} s"


def _changed(period: float, step: float) -> str:
    """Return what a period becomes, empty if it is kept; 0 stands for every step."""
    kept = steps_in(period, step) * step
    return f"{kept:.9g} s, not {period:.9g} s, {_no_multiple(step)}" if period and _differs(kept, period, step) else ""


def _differs(kept: float, period: float, step: float) -> bool:
    return abs(kept - period) > ROUNDING * step


def steps_in(period: float, step: float) -> int:
    """Return the whole number of steps nearest to a period, at least one."""
    return max(1, round(period / step))


def _used(system: System) -> Iterator[Record]:
    """Yield the entry of the settings by which each variable is recorded."""
    for component in system.components:
        for variable in component.fmu.variables.values():
            if is_recordable(component, variable):
                record = record_of(f"{component.name}.{variable.name}", system.settings.records)
                if record is not None:
                    yield record


def is_recordable(component: Component, variable: Variable) -> bool:
    """Whether a variable can be recorded besides the exchanged outputs."""
    return variable.type != "String" and variable.causality in MEASURED and variable.name not in component.outputs


def record_of(name: str, records: Sequence[Record]) -> Record | None:
    """Return the last entry that matches a variable's full name, None if there is none."""
    fits = [r for r in records if any(matcher(p)(name) for p in r.variables)]
    return fits[-1] if fits else None
