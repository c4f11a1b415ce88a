"""One description of a chart, two drawings of it: curves that differ to the eye, and the same from both renderers."""

from __future__ import annotations

import re
from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb

from master.report.charts.chart import (
    COLOURS,
    DASHES,
    GREY,
    MARK,
    Axis,
    Bars,
    Cells,
    Chart,
    Curve,
    Envelope,
    Level,
    Points,
    Ticks,
    ink_on,
    stroke,
)
from master.report.charts.interactive_figure import interactive_figure
from master.report.charts.sample_packing import packed
from master.report.charts.static_figure import static_figure
from master.report.html_markup import asset

X = np.linspace(0.0, 1.0, 11)


def chart(*parts, x=Axis("time", "s")):  # noqa: B008
    return Chart("key", "A chart", x, Axis("force", "N"), parts)


def many(count):
    return chart(*(Curve(f"curve {i}", X, i + X, stroke(i)) for i in range(count)))


def test_no_two_curves_of_a_chart_are_alike():
    styles = [(stroke(i).colour, stroke(i).dash) for i in range(36)]
    assert len(set(styles)) == len(styles)


def test_twelve_curves_can_be_told_apart_on_a_page_and_in_a_file():
    lines = [trace["line"] for trace in interactive_figure(many(12))["data"]]
    on_page = [(line["color"], line["dash"]) for line in lines]
    (axes,) = static_figure([many(12)]).axes
    in_file = [(to_hex(line.get_color()), line._dash_pattern) for line in axes.get_lines()]
    assert len(set(on_page)) == len({str(style) for style in in_file}) == 12
    assert [colour for colour, _ in in_file] == [colour for colour, _ in on_page]
    patterns = {dash: str(drawn[1][1]) for (_, dash), drawn in zip(on_page, in_file, strict=True)}
    assert len(set(patterns.values())) == len(patterns) == len(DASHES)


#: What is left of linear red, green and blue without the long, and without the medium cones [1]_.
#: .. [1] F. Vienot, H. Brettel, J. Mollon: Digital video colourmaps for checking the legibility of displays by
#:    dichromats. Color Research and Application 24 (1999), 243-252, equations for a standard monitor.
PROTANOPE = ((0.11238, 0.88762, 0.0), (0.11238, 0.88762, 0.0), (0.00401, -0.00401, 1.0))
DEUTERANOPE = ((0.29275, 0.70725, 0.0), (0.29275, 0.70725, 0.0), (-0.02234, 0.02234, 1.0))
EVERYONE = np.eye(3)
#: Linear red, green and blue to X, Y, Z relative to white (IEC 61966-2-1).
TO_XYZ = np.array([[0.4339, 0.3762, 0.1899], [0.2126, 0.7152, 0.0722], [0.0178, 0.1098, 0.8725]])


def lab(colour, sight):
    """Return a colour as it is seen in CIE L*a*b*, in which 2.3 is a difference that is just noticed."""
    values = np.array(to_rgb(colour))
    linear = np.where(values > 0.04045, ((values + 0.055) / 1.055) ** 2.4, values / 12.92)
    x, y, z = np.cbrt(TO_XYZ @ np.clip(np.asarray(sight) @ linear, 0.0, 1.0))
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize("sight", [EVERYONE, PROTANOPE, DEUTERANOPE], ids=["all cones", "protanope", "deuteranope"])
def test_colours_are_told_apart_without_red_or_green(sight):
    apart = {(a, b): np.linalg.norm(lab(a, sight) - lab(b, sight)) for a, b in combinations(COLOURS, 2)}
    assert min(apart.values()) > 6.0 * 2.3, min(apart, key=apart.get)


def test_the_moving_picture_has_the_colours_of_the_charts():
    root = asset("style.css").partition("@media")[0]
    found = dict(re.findall(r"--(wire|slack|messenger|raw|mark): (#[0-9a-f]{6})", root))
    assert found == {"wire": COLOURS[0], "slack": COLOURS[1], "messenger": GREY, "raw": GREY, "mark": MARK}


def test_twelve_bars_can_be_told_apart_on_a_page_and_in_a_file():
    drawn = chart(*(Bars(f"run {i}", ("mean",), X[:1], i) for i in range(12)), x=Axis("figure"))
    markers = [trace["marker"] for trace in interactive_figure(drawn)["data"]]
    (axes,) = static_figure([drawn]).axes
    in_file = [(to_hex(bar.get_facecolor()), bar.get_hatch()) for bars in axes.containers for bar in bars]
    assert len({(m["color"], m["pattern"]["shape"]) for m in markers}) == len(set(in_file)) == 12
    assert [colour for colour, _ in in_file] == [m["color"] for m in markers]


def test_both_renderers_draw_the_same_numbers_over_the_same_axes():
    drawn = chart(Curve("one", X, X**2, stroke(0)), Ticks("support", X[::5]), Level(0.5, "limit"))
    (axes,) = static_figure([drawn]).axes
    layout = interactive_figure(drawn)["layout"]
    assert axes.get_xlabel() == layout["xaxis"]["title"]["text"] == "time [s]"
    assert axes.get_ylabel() == layout["yaxis"]["title"]["text"] == "force [N]"
    assert axes.get_lines()[0].get_ydata().tolist() == (X**2).tolist()
    assert axes.get_lines()[1].get_ydata() == [0.5, 0.5]
    assert [s["y0"] for s in layout["shapes"]] == [0.5]


def test_what_a_page_hides_at_first_a_file_leaves_out():
    hidden = chart(Curve("one", X, X, stroke(0)), Curve("two", X, X, stroke(1), is_shown=False))
    assert [t.get("visible") for t in interactive_figure(hidden)["data"]] == [None, "legendonly"]
    (axes,) = static_figure([hidden]).axes
    assert [line.get_label() for line in axes.get_lines()] == ["one"]


def test_bars_of_one_chart_stand_side_by_side():
    names = ("mean", "sigma")
    (axes,) = static_figure([chart(*(Bars(f"run {i}", names, X[:2], i) for i in range(3)), x=Axis("figure"))]).axes
    edges = sorted((bar.get_x(), bar.get_x() + bar.get_width()) for bars in axes.containers for bar in bars)
    assert all(left[1] <= right[0] + 1e-12 for left, right in pairwise(edges))
    assert [label.get_text() for label in axes.get_xticklabels()] == list(names)


def test_a_logarithmic_axis_is_one_in_both():
    spectrum = chart(Curve("one", 1.0 + X, 1.0 + X, stroke(0)), x=Axis("frequency", "Hz", (1.0, 10.0), True, (1, 2, 5)))
    layout = interactive_figure(spectrum)["layout"]["xaxis"]
    assert (layout["type"], layout["range"], layout["tickvals"]) == ("log", [0.0, 1.0], [1, 2, 5])
    (axes,) = static_figure([spectrum]).axes
    assert axes.get_xscale() == "log"
    assert axes.get_xlim() == (1.0, 10.0)


def test_the_limits_that_are_not_met_wrap_on_a_narrow_page():
    rule = next(line for line in asset("style.css").splitlines() if line.startswith(".fail {"))
    assert "nowrap" not in rule  # several limits are one line too long for 400 px


MAP = Cells(
    np.array([[1.0, 2.0], [np.nan, 4.0]]),
    (("1", "2"), ("", "4")),
    np.array([[False, True], [False, False]]),
    (("one", "two"), ("", "four")),
)


def test_a_map_has_its_values_in_their_cells_on_a_page_and_in_a_file():
    whole, hatching = interactive_figure(chart(MAP))["data"]
    cells = {(x, base + 0.5): k for k, (x, base) in enumerate(zip(whole["x"], whole["base"], strict=True))}
    assert {place: whole["text"][k] for place, k in cells.items()} == {(0, 0): "1", (1, 0): "2", (1, 1): "4"}
    assert (hatching["x"], hatching["base"]) == ([1], [-0.5])
    assert hatching["marker"]["pattern"]["shape"] == "/"
    (axes,) = static_figure([chart(MAP)]).axes
    drawn = {t.get_position(): t.get_text() for t in axes.texts}
    assert drawn == {(0, 0): "1", (1, 0): "2", (1, 1): "4"}
    boxes = {(p.get_x() + 0.5, p.get_y() + 0.5): p for p in axes.patches}
    assert {place for place, p in boxes.items() if p.get_hatch()} == {(1.0, 0.0)}
    colours = whole["marker"]["color"]
    assert {place: to_hex(p.get_facecolor()) for place, p in boxes.items()} == {p: colours[k] for p, k in cells.items()}


def test_what_is_written_in_a_cell_can_be_read():
    """The contrast is at least 4.5, as the accessibility guidelines of the web ask for (WCAG 2.1, 1.4.3)."""
    values = np.linspace(0.0, 1.0, 201)[None, :]
    blank = (("",) * 201,)
    (colours,) = Cells(values, blank, values > 2.0, blank).colours

    def luminance(colour):
        v = np.array(to_rgb(colour))
        return np.where(v > 0.03928, ((v + 0.055) / 1.055) ** 2.4, v / 12.92) @ (0.2126, 0.7152, 0.0722)

    for colour in colours:
        low, high = sorted((luminance(colour), luminance(ink_on(colour))))
        assert (high + 0.05) / (low + 0.05) > 4.5
    lightness = [luminance(c) for c in colours]
    assert lightness == sorted(lightness, reverse=True)


def test_bars_that_lie_have_their_intervals_along_the_abscissa():
    bars = Bars(
        "b",
        np.array([0.0, 1.0]),
        np.array([2.0, -3.0]),
        interval=(np.array([1.0, -5.0]), np.array([2.5, -1.0])),
        is_lying=True,
    )
    (trace,) = interactive_figure(chart(bars))["data"]
    assert trace["orientation"] == "h"
    assert trace["error_x"]["array"] == packed(np.array([0.5, 2.0]))
    assert trace["error_x"]["arrayminus"] == packed(np.array([1.0, 2.0]))
    (axes,) = static_figure([chart(bars)]).axes
    assert [(p.get_y() + 0.5 * p.get_height(), p.get_width()) for p in axes.patches] == [(0.0, 2.0), (1.0, -3.0)]
    (lines,) = (c for c in axes.collections if len(c.get_segments()) == 2)
    assert [s[:, 0].tolist() for s in lines.get_segments()] == [[1.0, 2.5], [-5.0, -1.0]]


def test_an_envelope_goes_forth_below_and_back_above_and_has_gaps():
    low = np.array([0.0, 1.0, np.nan, 3.0, 4.0])
    envelope = Envelope("e", np.arange(5.0), low, low + 1.0, COLOURS[0])
    assert [x.tolist() for x, _ in envelope.outlines] == [[0.0, 1.0, 1.0, 0.0], [3.0, 4.0, 4.0, 3.0]]
    assert [y.tolist() for _, y in envelope.outlines] == [[0.0, 1.0, 2.0, 1.0], [3.0, 4.0, 5.0, 4.0]]
    (trace,) = interactive_figure(chart(envelope))["data"]
    assert trace["fill"] == "toself"
    nothing = Envelope("e", np.arange(2.0), np.full(2, np.nan), np.full(2, np.nan), COLOURS[0])
    interactive_figure(chart(nothing))
    static_figure([chart(nothing, envelope)])


def test_names_are_text_on_a_page():
    name = "<b>a</b> & b"
    parts = (
        Curve(name, X, X, stroke(0)),
        Points(name, X, X, "x"),
        Bars(name, (name,), np.ones(1)),
        Bars("b", X, X, words=(name,) * len(X)),
    )
    drawn = interactive_figure(chart(*parts, x=Axis(name, ticks=(0.0,), words=(name,))))
    assert "<b>" not in str(drawn)
    assert drawn["data"][0]["name"] == "&lt;b&gt;a&lt;/b&gt; &amp; b"
