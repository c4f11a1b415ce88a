"""Whether a long run stays as fast, as small and as right as it began: ``python benchmarks/soak.py [--minutes 10]``.

A pantograph (CX at 300 km/h, unless told otherwise) runs along equal spans in LN2's materials. After every window a row
tells how fast it was, what the process has in memory, and the statistics of the contact force, which from the second
window on should repeat.

A lumped pantograph is solved together with the line; a multibody one exchanges force and strip with it once a step, as
FMUs do, and its rows end with the largest violation of its joints: 0 in the reduced form, in which they hold by
construction.

The line is as long as the run, 100 spans for a minute at 300 km/h, and a step costs more the longer the line is.
With ``--periodic`` it closes on itself after ``--spans`` spans, 20 unless told otherwise, and costs the same however
long the run is. That assumes a train of pantographs, one every 20 spans: each meets what the one before has left of the
wire's motion; `ring_length.py` tells how much that is. The last column then tells by how much the force at any step is
off that of the window before, in which the pantograph must have passed a whole number of span pairs.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from lines import SPAN, long_line, ring
from timing import memory, on_one_thread, table

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_pantograph
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.multibody.multibody_part import MultibodyPantographPart

STEP = 1e-3
#: Where the pantograph starts, and how far from the end it stops [m].
MARGIN = 4.0 * SPAN
#: The roof: height and vertical velocity.
_BASE = np.zeros(2)

Definition = LumpedDefinition | MechanismDefinition


class System(Protocol):
    """A pantograph on a line."""

    violation: float

    def step(self, end: float) -> float:
        """Advance by `STEP` to the time ``end`` [s] and return the contact force [N]."""


class Lumped:
    """A lumped pantograph and a line as one system; there are no joints that could open."""

    violation = math.nan

    def __init__(self, line: CatenaryDefinition, pantograph: LumpedDefinition) -> None:
        self._coupled = CoupledModel(CatenaryModel(line), [pantograph])

    def step(self, end: float) -> float:
        """Advance to ``end`` [s] and return the contact force [N]."""
        return float(self._coupled.step(STEP, end)[0].sum())


class Multibody:
    """A multibody pantograph and a line that both step with what the other gave after the last step.

    Attributes
    ----------
    violation : float
        Of the joints, at the end of the last step [m].
    """

    def __init__(self, line: CatenaryDefinition, pantograph: MechanismDefinition) -> None:
        self._line, self._pantograph = CatenaryPart(line), MultibodyPantographPart(pantograph)
        names = [name for name, _, _ in self._pantograph.observed]
        self._place = names.index("joints.violation")
        self.violation = 0.0
        for _ in range(2):  # each receives what the other gives at rest
            self._pantograph.initialise(0.0, self._line.contact_force[0], self._line.contact_point[0], _BASE)
            self._line.initialise(0.0, self._pantograph.strip[None])

    def step(self, end: float) -> float:
        """Advance to ``end`` [s] and return the contact force [N]."""
        line, pantograph = self._line, self._pantograph
        strips, force, point = pantograph.strip[None].copy(), float(line.contact_force[0]), line.contact_point[0].copy()
        pantograph.step(force, point, _BASE, STEP)
        line.step(strips, STEP)
        self.violation = float(pantograph.observation_values()[self._place])
        return float(line.contact_force[0])


@dataclass(frozen=True)
class Window:
    """A part of the run.

    Attributes
    ----------
    end : float
        Simulated time at its end [s].
    speed : float
        Steps in a second.
    memory : float
        At its end [MB].
    force : ndarray, shape (n,)
        Contact force at every step, not filtered [N].
    violation : float
        The largest of the joints within it [m], NaN where there are none.
    """

    end: float
    speed: float
    memory: float
    force: FloatArray
    violation: float

    @property
    def row(self) -> tuple[str, ...]:
        """Return its figures as text."""
        force = self.force
        figures = (f"{f:.1f}" for f in (force.mean(), force.std(), force.min(), force.max()))
        speed, violation = (f"{self.speed:.0f}", f"{self.speed * STEP:.2f}"), f"{self.violation:.1e}"
        return (f"{self.end:.1f}", *speed, f"{self.memory:.1f}", *figures, violation)


def main() -> None:
    on_one_thread()
    options = _options()
    pantograph = at_speed(load_pantograph(options.pantograph), options.speed)
    speed, stop = speed_of(pantograph), 60.0 * options.minutes
    spans = options.spans if options.periodic else 0
    system = system_of(line(stop * speed, spans), pantograph)
    rows: list[tuple[str, ...]] = []
    before = np.zeros(0)
    for window in run(system, stop, options.window):
        rows.append((*window.row, off(window.force, before)) if spans else window.row)
        before = window.force
        if options.follow:
            print(*rows[-1], sep="\t", flush=True)
    columns = ("until s", "steps a second", "times real time", "MB", "mean N", "deviation N", "least N", "most N")
    title = f"{options.minutes:g} min, {options.pantograph} at {3.6 * speed:.0f} km/h"
    title += f", {spans} spans that close on themselves" if spans else ""
    table(title, (*columns, "joints open m", *(["off before N"] if spans else [])), rows)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--minutes", type=float, default=10.0, help="simulated time, default 10")
    parser.add_argument("--window", type=float, default=6.0, help="simulated time of a row [s], default 6: ten spans")
    parser.add_argument("--pantograph", default="CX", help="of the library, lumped or multibody, default CX")
    parser.add_argument("--speed", type=float, help="of the train [m/s], default the pantograph's own")
    parser.add_argument("--follow", action="store_true", help="print every row when its window ends, too")
    parser.add_argument("--periodic", action="store_true", help="on a line that closes on itself")
    parser.add_argument("--spans", type=int, default=20, help="of the line that closes on itself, default 20")
    return parser.parse_args()


def line(way: float, spans: int = 0) -> CatenaryDefinition:
    """Return a line for a way [m], or one that closes on itself after a number of spans."""
    return ring(spans) if spans else long_line(math.ceil((way + 2.0 * MARGIN) / SPAN))


def off(force: FloatArray, before: FloatArray) -> str:
    """Return by how much a window's force is off that of the one before [N], as text."""
    return f"{np.abs(force - before).max():.1e}" if len(force) == len(before) else ""


def at_speed(pantograph: Definition, speed: float | None) -> Definition:
    """Return a pantograph at the beginning of the way, at a speed [m/s] or its own."""
    values = {"start_position": MARGIN} if speed is None else {"start_position": MARGIN, "speed": speed}
    return pantograph.with_values(values)


def speed_of(pantograph: Definition) -> float:
    """Return a pantograph's speed [m/s]."""
    return pantograph.speed


def system_of(line: CatenaryDefinition, pantograph: Definition) -> System:
    """Return a pantograph on a line, at rest."""
    return Lumped(line, pantograph) if isinstance(pantograph, LumpedDefinition) else Multibody(line, pantograph)


def run(system: System, stop: float, length: float) -> Iterator[Window]:
    """Run to ``stop`` [s], yield windows of a length [s]."""
    whole, count = round(stop / STEP), round(length / STEP)
    for first in range(0, whole, count):
        steps = range(first + 1, min(first + count, whole) + 1)
        force, violation = np.empty(len(steps)), np.empty(len(steps))
        begin = time.process_time()
        for i, n in enumerate(steps):
            force[i] = system.step(n * STEP)
            violation[i] = system.violation
        taken = time.process_time() - begin
        yield Window(steps[-1] * STEP, len(steps) / taken, memory(), force, float(violation.max()))


if __name__ == "__main__":
    main()
