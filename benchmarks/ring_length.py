"""How long a line that closes on itself must be: ``python benchmarks/ring_length.py [--spans 10 20 40 80]``.

A pantograph (CX at 300 km/h, unless told otherwise) goes round lines of equal spans in LN2's materials until its force
repeats, and runs along an open line to the middle of it. What the pantograph meets on a line that closes on itself is
what it has left there a lap before; the longer the line, the less that is. A row tells the figures of the contact force
below 20 Hz over the last two spans, and by how much the force itself is off that on the open line at most.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from lines import SPAN, long_line, ring
from timing import on_one_thread, table

from master.evaluation.filters import ForceFilter, low_pass
from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.line_model import CatenaryModel
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_lumped
from models.pantograph.lumped.lumped_definition import LumpedDefinition

STEP = 1e-3
#: Where the pantograph starts [m]; how far it runs at least before it is looked at, in spans; what is looked at.
START, SETTLING, SHOWN = 4.0 * SPAN, 40, 2
#: What the filter needs on both sides, in spans.
REACH = 1


@dataclass(frozen=True)
class Passage:
    """The contact force over two spans, as it is and below 20 Hz, at every step [N]."""

    raw: FloatArray
    filtered: FloatArray

    def row(self, name: str, reference: Passage) -> tuple[str, ...]:
        """Return its figures as text."""
        force = self.filtered
        figures = (f"{f:.3f}" for f in (force.mean(), force.std(), force.min(), force.max()))
        off = (f"{np.abs(one - other).max():.1e}" for one, other in zip(self.both, reference.both, strict=True))
        return (name, *figures, *off)

    @property
    def both(self) -> tuple[FloatArray, FloatArray]:
        """Return the force below 20 Hz and as it is."""
        return self.filtered, self.raw


def main() -> None:
    on_one_thread()
    options = _options()
    pantograph = load_lumped(options.pantograph).with_values({"start_position": START})
    spans = SETTLING + SHOWN + REACH
    reference = passage(long_line(2 * spans), pantograph, spans)
    runs = {f"{n} spans": passage(ring(n), pantograph, max(spans, 2 * n)) for n in options.spans}
    rows = [run.row(name, reference) for name, run in {"open": reference, **runs}.items()]
    title = f"{options.pantograph} at {3.6 * pantograph.speed:.0f} km/h, contact force below 20 Hz"
    columns = ("line", "mean N", "deviation N", "least N", "most N", "off the open line N", "the same, not filtered N")
    table(title, columns, rows)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--spans", nargs="+", type=int, default=[10, 20, 40, 80], help="of the lines, even numbers")
    parser.add_argument("--pantograph", default="CX", help="of the library, lumped, default CX")
    return parser.parse_args()


def passage(line: CatenaryDefinition, pantograph: LumpedDefinition, spans: int) -> Passage:
    """Return the force over the last two spans but one of a run."""
    system = CoupledModel(CatenaryModel(line), [pantograph])
    in_span = round(SPAN / pantograph.speed / STEP)
    spans += spans % 2
    force = [float(system.step(STEP, n * STEP)[0].sum()) for n in range(1, spans * in_span + 1)]
    shown = slice(-(SHOWN + REACH) * in_span, -REACH * in_span)
    return Passage(np.array(force)[shown], low_pass(np.array(force), STEP, ForceFilter("fft"))[shown])


if __name__ == "__main__":
    main()
