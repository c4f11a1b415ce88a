"""The chart and the table of a measured contact force beside the simulated one."""

from __future__ import annotations

import numpy as np

from master.evaluation.measured_force import MeasuredComparison
from master.report.charts.chart import Axis, Chart, Curve, stroke
from master.report.charts.force_charts import TRACK


def comparison_rows(c: MeasuredComparison) -> list[tuple[str, ...]]:
    """Return mean, sigma, extremes of both and their difference, and the correlation."""
    figures = (
        ("mean force [N]", np.mean),
        ("standard deviation [N]", np.std),
        ("maximum [N]", np.max),
        ("minimum [N]", np.min),
    )
    rows: list[tuple[str, ...]] = []
    for name, figure in figures:
        one, two = float(figure(c.simulated)), float(figure(c.measured))
        rows.append((name, f"{one:.1f}", f"{two:.1f}", f"{one - two:+.1f}"))
    rows.append(("rms difference [N]", "", "", f"{c.rms:.1f}"))
    rows.append(("correlation", "", "", "-" if c.correlation is None else f"{c.correlation:.3f}"))
    return rows


def comparison_chart(c: MeasuredComparison) -> Chart:
    """Return both forces over track position."""
    curves = (
        Curve(f"simulated, {c.pantograph}", c.position, c.simulated, stroke(0, 2.2)),
        Curve("measured", c.position, c.measured, stroke(1, 1.6)),
    )
    y = Axis("contact force, low-passed", "N")
    return Chart("measured_force", "Contact force, measured and simulated", TRACK, y, curves)
