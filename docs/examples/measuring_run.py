"""Make measuring_run.csv: what a measuring coach would write down under an LN2 whose droppers were cut wrong.

    python docs/examples/measuring_run.py

Lengths are off by 10 mm (one standard deviation, seed 7); heights scatter by 1 mm, staggers by 5 mm; the coach counts
its way from another origin and 0.08 % too short, and misses 12 m.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from models.arrays import FloatArray
from models.catenary.condition.fitted_lengths import with_errors
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.statics.wire_course import wire_courses
from models.library.catalogue import load_line

FROM, TO, EVERY, GAP = 260.0, 990.0, 0.5, (430.0, 442.0)
ORIGIN, SHORT = 84_300.0, 0.0008


def line_and_errors() -> tuple[StaticState, FloatArray]:
    """Return LN2 as designed, and what its droppers are too long [m]; beyond 250 ... 1000 m they are right."""
    line = load_line("LN2")
    design = kept_form(line, build_mesh(line))
    x = design.positions[design.shape.mesh.droppers[:, 0], 0]
    drawn = np.clip(np.random.default_rng(7).standard_normal(len(x)), -3.0, 3.0)
    return design, np.where((x > 250.0) & (x < 1000.0), 0.010 * drawn, 0.0)


def main() -> None:
    """Write the run."""
    rng = np.random.default_rng(8)
    wire = wire_courses(with_errors(*line_and_errors()))[0]
    x = np.arange(FROM, TO, EVERY)
    x = x[(x < GAP[0]) | (x > GAP[1])]
    height = wire.height(x) + 0.001 * rng.standard_normal(len(x))
    stagger = wire.lateral(x) + 0.005 * rng.standard_normal(len(x))
    position = ORIGIN + (x - FROM) / (1.0 + SHORT)
    rows = (f"{1e-3 * p:.5f},{1e3 * z:.1f},{1e3 * y:.0f}" for p, z, y in zip(position, height, stagger, strict=True))
    text = "\n".join(["position [km],height [mm],stagger [mm]", *rows])
    Path(__file__).with_suffix(".csv").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
