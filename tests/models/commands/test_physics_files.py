"""Figures of the verbs: a heading fits over the figure, and rounding errors do not fill an axis."""

import numpy as np
import pytest

matplotlib = pytest.importorskip("matplotlib")

from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

from models.commands.physics_files import set_heading, show_no_noise  # noqa: E402

LONG = "Worked example: four-bar arms, levelled head on two springs, constant-force cam: static force at 0.05 m/s"


@pytest.mark.parametrize("width", [8, 9])
def test_a_long_heading_stays_within_the_figure(width):
    figure = Figure(figsize=(width, 5), layout="constrained")
    figure.subplots()
    set_heading(figure, LONG)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    box = figure._suptitle.get_window_extent(canvas.get_renderer())
    assert box.x0 >= 0.0
    assert box.x1 <= figure.bbox.width
    assert figure._suptitle.get_text().replace("\n", " ") == LONG


@pytest.mark.parametrize(
    ("values", "unit", "span"),
    [
        (120.0 + 1e-6 * np.arange(5.0), "N", 2.4),
        (1e-6 * np.arange(5.0), "N", 1.0),
        (50.0 + np.array([0.0, 10.0]), "N", 11.0),  # matplotlib's margins: 5 % at each end
    ],
)
def test_an_axis_spans_more_than_rounding_errors(values, unit, span):
    axes = Figure().subplots()
    axes.plot(values)
    show_no_noise(axes, values, unit)
    low, high = axes.get_ylim()
    assert high - low == pytest.approx(span)
    assert low < values.min()
    assert high > values.max()
