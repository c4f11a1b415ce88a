"""Profile and plan of a line at rest as drawings (DXF), in m, true to scale, with a layer for each component.

The profile has heights over the length of the track, the plan lateral places beside the track's axis, which lies in its
curves; both in the rail plane, as everything of a line is. Needs `ezdxf`, an extra.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Support
from models.catenary.definition.track_definition import Track
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.track import track_at
from models.layout.sheet_problems import LayoutError, Place, SheetProblems
from models.numerics.gauss_points import gauss_points

#: Layer -> colour of AutoCAD's index.
_COLOURS: Final = {
    "track": 8, "supports": 9, "contact_wire": 1, "messenger_wire": 5, "stitch_wire": 4, "auxiliary_wire": 6,
    "droppers": 3, "hangers": 3, "steady_arms": 30, "labels": 7,
}  # fmt: skip
#: Height of letters, of names and spans and of figures beside a wire [m].
_LETTERS, _SMALL = 0.25, 0.12
#: Longest straight piece of the track's axis in a curve [m].
_PIECE: Final = 1.0


def profile_drawing(state: StaticState) -> str:
    """Return the profile of a line as the text of a DXF file: heights over the length of the track.

    Raises
    ------
    LayoutError
        If ezdxf is not installed.
    """
    drawing = _Drawing(state, lambda points: points[:, [0, 2]])
    ends = _ends(state.shape.definition)
    drawing.curve("track", np.array([[ends[0], 0.0, 0.0], [ends[1], 0.0, 0.0]]))
    drawing.wires()
    mesh = state.shape.mesh
    for (lower, upper), hanger, length in zip(mesh.droppers, mesh.is_hanger, state.unstrained_length, strict=True):
        bar = state.positions[[lower, upper]]
        drawing.curve("hangers" if hanger else "droppers", bar)
        beside = bar.mean(axis=0) + np.array([_beside(mesh.section[lower]), 0.0, 0.0])
        drawing.label(f"{1e3 * length:.0f}", beside, size=_SMALL, turned=True)
    for section, support, (low, high) in _supports(state):
        drawing.curve("supports", np.array([[support.x, 0.0, 0.0], [support.x, 0.0, high]]))
        beside = support.x + 2.5 * _beside(section)
        drawing.label(f"{low:.3f}", np.array([beside, 0.0, low - 1.5 * _SMALL]), size=_SMALL)
    for x, name in _names(state.shape.definition).items():
        drawing.label(name, np.array([x, 0.0, -2.0 * _LETTERS]))
    for a, b in _spans(state.shape.definition):
        drawing.label(f"{b - a:.2f}", np.array([0.5 * (a + b), 0.0, -2.0 * _LETTERS]))
    return drawing.text()


def plan_drawing(state: StaticState) -> str:
    """Return the plan of a line as the text of a DXF file: the track's axis in its curves, wires and arms beside it.

    Raises
    ------
    LayoutError
        If ezdxf is not installed.
    """
    definition = state.shape.definition
    start, end = _ends(definition)
    axis = _Axis(definition.track, start, end)
    drawing = _Drawing(state, axis.beside)
    drawing.curve("track", np.column_stack([axis.s, np.zeros((len(axis.s), 2))]))
    drawing.wires()
    for bar in state.shape.mesh.arms:
        drawing.curve("steady_arms", state.positions[bar])
    for _, support, _ in _supports(state):
        y = support.stagger + (2.0 if support.stagger >= 0.0 else -2.0) * _SMALL
        drawing.curve("supports", np.array([[support.x, -_LETTERS, 0.0], [support.x, _LETTERS, 0.0]]))
        drawing.label(f"{1e3 * support.stagger:+.0f}", np.array([support.x + 3.0 * _SMALL, y, 0.0]), size=_SMALL)
    for x, name in _names(definition).items():
        drawing.label(name, np.array([x, -10.0 * _LETTERS, 0.0]))
    return drawing.text()


class _Axis:
    """The axis of a track in plan, from the start, where it runs along x.

    Attributes
    ----------
    s : ndarray, shape (n,)
        Lengths along it [m].
    """

    def __init__(self, track: Track | None, start: float, end: float) -> None:
        self._track = track
        if track is None or not any(track.curvatures):
            self.s = np.array([start, end])
            self._x, self._y, self._angle = self.s.copy(), np.zeros(2), np.zeros(2)
            return
        knots = [x for x in track.positions if start < x < end]
        even = np.linspace(start, end, 2 + int((end - start) / _PIECE))
        self.s = np.unique(np.concatenate([even, knots]))
        step = np.diff(self.s)
        nodes, weights = gauss_points(3)
        # The curvature is linear within a piece, so its integral to any point is exact by the mean of two values.
        inner = self.s[:-1, None] + 0.5 * (1.0 + nodes) * step[:, None]
        after = track_at(track, self.s[:-1] + 1e-9 * step).curvature
        before = track_at(track, self.s[1:] - 1e-9 * step).curvature
        self._angle = np.concatenate([[0.0], np.cumsum(0.5 * (after + before) * step)])
        share = (inner - self.s[:-1, None]) / step[:, None]
        here = after[:, None] + share * (before - after)[:, None]
        angle = self._angle[:-1, None] + 0.5 * (after[:, None] + here) * share * step[:, None]
        self._x = start + np.concatenate([[0.0], np.cumsum(0.5 * step * (np.cos(angle) @ weights))])
        self._y = np.concatenate([[0.0], np.cumsum(0.5 * step * (np.sin(angle) @ weights))])

    def beside(self, points: FloatArray) -> FloatArray:
        """Return where points (along the track, to its left, up) lie in plan, shape (n, 2) [m]."""
        s, y = points[:, 0], points[:, 1]
        x0, y0, angle = (np.interp(s, self.s, values) for values in (self._x, self._y, self._angle))
        if len(self.s) > 2:  # from the nearest place before, on, along the arc
            k = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)
            rest = s - self.s[k]
            mean = 0.5 * (self._angle[k] + angle)
            x0, y0 = self._x[k] + rest * np.cos(mean), self._y[k] + rest * np.sin(mean)
        return np.column_stack([x0 - y * np.sin(angle), y0 + y * np.cos(angle)])


class _Drawing:
    """A drawing of a line; ``place`` gives the points of the sheet for points of the line, (n, 3) -> (n, 2)."""

    def __init__(self, state: StaticState, place: Callable[[FloatArray], FloatArray]) -> None:
        try:
            from ezdxf import units
            from ezdxf.filemanagement import new
        except ImportError as error:
            problems = SheetProblems("--dxf")
            problems.add(Place(""), "needs ezdxf, which is not installed: pip install 'openpanto[dxf]'")
            raise LayoutError(tuple(problems.found)) from error
        self.state, self.place = state, place
        self.document: Any = new("R2010", setup=True)
        self.document.units = units.M
        self.document.header["$MEASUREMENT"] = 1  # metric
        self.space: Any = self.document.modelspace()

    def wires(self) -> None:
        """Draw all wires, those of each section on layers of their own if there are several."""
        several = len(self.state.shape.definition.sections) > 1
        for chain in self.state.shape.mesh.chains:
            suffix = f"_{chain.section + 1}" if several else ""
            self.curve(chain.component, self.state.positions[chain.nodes], suffix)

    def curve(self, layer: str, points: FloatArray, suffix: str = "") -> None:
        """Draw a line through points of the line, shape (n, 3)."""
        self.space.add_lwpolyline(self.place(points).tolist(), dxfattribs={"layer": self._layer(layer, suffix)})

    def label(self, text: str, point: FloatArray, *, size: float = _LETTERS, turned: bool = False) -> None:
        """Write a text at a point of the line, shape (3,)."""
        from ezdxf.enums import TextEntityAlignment

        where = self.place(point[None, :])[0]
        attributes = {"layer": self._layer("labels"), "height": size, "rotation": 90.0 if turned else 0.0}
        entity = self.space.add_text(text, dxfattribs=attributes)
        entity.set_placement(tuple(where), align=TextEntityAlignment.MIDDLE_CENTER)

    def text(self) -> str:
        """Return the text of the file."""
        stream = io.StringIO()
        self.document.write(stream)
        return stream.getvalue()

    def _layer(self, name: str, suffix: str = "") -> str:
        if name + suffix not in self.document.layers:
            self.document.layers.add(name + suffix, color=_COLOURS[name])
        return name + suffix


def _ends(definition: CatenaryDefinition) -> tuple[float, float]:
    spans = [span for section in definition.sections for span in section.spans]
    return min(span.start for span in spans), max(span.end for span in spans)


def _names(definition: CatenaryDefinition) -> dict[float, str]:
    """Return the names of supports by their places; the mast of two sections has one, and without a name its place."""
    supports = [support for section in definition.sections for support in section.supports]
    places = {support.x: f"x {support.x:.2f}" for support in supports}
    return places | {support.x: support.structure for support in supports if support.structure}


def _beside(section: int) -> float:
    """Return how far to the right of a line its figure stands, for every other section to the left [m]."""
    return (1.0 if section % 2 == 0 else -1.0) * 1.5 * _SMALL


def _spans(definition: CatenaryDefinition) -> list[tuple[float, float]]:
    """Return the spans of all sections; those that two sections share once."""
    return sorted({(span.start, span.end) for section in definition.sections for span in section.spans})


def _supports(state: StaticState) -> Iterator[tuple[int, Support, FloatArray]]:
    """Yield the supports with the number of their section from 0, heights of contact and messenger wire there [m]."""
    mesh = state.shape.mesh
    for number, section in enumerate(state.shape.definition.sections):
        chains = {c.component: state.positions[c.nodes] for c in mesh.chains if c.section == number}
        for support in section.supports:
            wires = (chains[name] for name in ("contact_wire", "messenger_wire"))
            yield number, support, np.array([np.interp(support.x, p[:, 0], p[:, 2]) for p in wires])
