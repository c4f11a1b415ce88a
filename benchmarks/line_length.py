"""How a line's cost grows with its length: ``python benchmarks/line_length.py [SPANS ...]``.

A simple line of 50 m spans in LN2's materials; building, memory, and steps at 1 ms with a strip on the wire, each
compared with the shortest line in the same run.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable

import numpy as np
from timing import by_turns, table

from models.catenary.model import CatenaryModel, StripMotion
from models.catenary.parameters import CatenaryDefinition, read
from models.definition import Table
from models.library import line_path

STEP = 1e-3
STEPS = 100


def line(spans: int) -> CatenaryDefinition:
    """Return LN2 with ``spans`` equal spans."""
    data = Table.load(line_path("LN2")).data
    rule = {"start": [0.0, "m", "benchmark"], "count": spans, "length": [50.0, "m", "benchmark"]}
    return read(Table.from_dict(data | {"spans": rule | {"droppers": data["spans"]["droppers"]}}, "benchmark"))


def steps(model: CatenaryModel) -> Callable[[], None]:
    """Return a function that moves a strip along the wire."""
    state = model.initial_state()
    place = {"x": 140.0}

    def run() -> None:
        for _ in range(STEPS):
            place["x"] += 83.0 * STEP
            x = 140.0 + (place["x"] - 140.0) % 200.0
            strip = np.array([[[[x, y, 5.08], [83.0, 0.0, 0.0]] for y in (0.7, -0.7)]])
            model.step(state, STEP, StripMotion(strip, np.zeros(1)))

    return run


def main(lengths: list[int]) -> None:
    models, built, memory = {}, {}, {}
    for spans in lengths:
        begin = time.perf_counter()
        models[spans] = CatenaryModel(line(spans))
        models[spans]._stepper(STEP)
        built[spans] = time.perf_counter() - begin
        memory[spans] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    best = by_turns({str(n): steps(m) for n, m in models.items()}, rounds=5)
    first = lengths[0]
    rows = [
        (
            str(n),
            str(len(models[n].free)),
            f"{built[n]:.2f}",
            f"{built[n] / built[first]:.1f}",
            f"{1e3 * best[str(n)] / STEPS:.3f}",
            f"{best[str(n)] / best[str(first)]:.1f}",
            f"{n / first:.1f}",
            f"{memory[n]:.0f}",
        )
        for n in lengths
    ]
    columns = ("spans", "dof", "build s", "ratio", "ms per step", "ratio", "length ratio", "peak MB so far")
    table("Cost over length", columns, rows)


if __name__ == "__main__":
    main([int(a) for a in sys.argv[1:]] or [10, 25, 50, 100, 200])
