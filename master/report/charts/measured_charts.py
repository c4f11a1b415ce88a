"""The chart and the table of a measured contact force beside the simulated one."""

from __future__ import annotations

import numpy as np

from master.evaluation.measured_force import MeasuredComparison
from master.report.charts.run_charts import Axes, Chart, Curve, curve_trace


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
    traces = [
        curve_trace(c.position, c.simulated, Curve(0, f"simulated, {c.pantograph}", 2.2)),
        curve_trace(c.position, c.measured, Curve(1, "measured", 1.6)),
    ]
    layout = Axes("track position of the contact [m]", "contact force, low-passed [N]").layout()
    return Chart("measured_force", "Contact force, measured and simulated", {"data": traces, "layout": layout})
