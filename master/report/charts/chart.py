"""The description of a chart: curves, bars, points and marks over two axes with units.

Nothing here draws: `interactive_figure` turns a chart into what plotly.js shows on a page, `static_figure` into a
figure for a file. Curves differ in dash and width as well as in colour (the palette of Okabe and Ito, its blue lighter,
so that it stands out on a dark page too), bars in hatching: charts survive a grey printer and colour-blind eyes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Literal

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.report.charts.sample_packing import MOST_POINTS, kept_samples

Dash = Literal["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"]

COLOURS: Final = ("#1f80c4", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
DASHES: Final[tuple[Dash, ...]] = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
#: Colours of what lies behind the curves, of marks along the line, and of limits.
GREY: Final = "#8a8f98"
MARK: Final = "#6b7280"
LIMIT: Final = "#b3261e"


@dataclass(frozen=True)
class Axis:
    """What an axis shows.

    Attributes
    ----------
    name, unit : str
        The unit is empty for names and numbers of things.
    limits : (float, float), optional
        The range shown at first; that of the data if None.
    is_logarithmic : bool
    ticks : tuple of float
        Positions of the numbers; left to the renderer if empty.
    words : tuple of str
        What stands there instead of the numbers.
    """

    name: str
    unit: str = ""
    limits: tuple[float, float] | None = None
    is_logarithmic: bool = False
    ticks: tuple[float, ...] = ()
    words: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Name and unit as printed."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Stroke:
    """How a line is drawn; the width is in points."""

    colour: str
    dash: Dash = "solid"
    width: float = 1.8


def stroke(index: int, width: float = 1.8) -> Stroke:
    """Return the stroke of a chart's curve by its number; no two of the first 36 have the same colour and dash."""
    dash = DASHES[(index + index // len(COLOURS)) % len(DASHES)]
    return Stroke(COLOURS[index % len(COLOURS)], dash, width)


def fill(index: int) -> tuple[str, int]:
    """Return colour and number of the hatching (0 to 5) of a chart's bars by their number, no two of 36 alike."""
    return COLOURS[index % len(COLOURS)], (index + index // len(COLOURS)) % 6


@dataclass(frozen=True)
class Curve:
    """A line through points, interrupted where they are NaN.

    Attributes
    ----------
    name : str
        In the legend.
    x, y : ndarray, shape (n,)
    stroke : Stroke
    is_shown : bool
        Whether it is drawn at first; a page shows it when its name is clicked, a file leaves it out.
    is_whole : bool
        Whether all points are drawn, or only those that can be seen (`kept_samples`).
    most : int
        Largest number of points drawn, unless it is whole.
    has_marks : bool
        Whether its points are marked.
    """

    name: str
    x: FloatArray
    y: FloatArray
    stroke: Stroke
    is_shown: bool = True
    is_whole: bool = False
    most: int = MOST_POINTS
    has_marks: bool = False

    @property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """The points of x and y that are drawn."""
        if self.is_whole:
            return self.x, self.y
        kept = kept_samples(self.y, self.most)
        return self.x[kept], self.y[kept]


@dataclass(frozen=True)
class Bars:
    """Bars over places or names; those of one chart stand side by side.

    Attributes
    ----------
    name : str
        In the legend.
    x : ndarray or tuple of str, shape (n,)
    y : ndarray, shape (n,)
    index : int
        Number of colour and hatching (`fill`).
    width : float, optional
        In units of the abscissa.
    words : tuple of str
        Text that a page shows when a bar is pointed at, instead of its numbers.
    interval : tuple of ndarray, optional
        Low and high ends of an interval about each bar's end, drawn as a thin line.
    is_lying : bool
        Whether the bars lie: ``x`` is then along the ordinate and ``y`` along the abscissa.
    """

    name: str
    x: FloatArray | tuple[str, ...]
    y: FloatArray
    index: int = 0
    width: float | None = None
    words: tuple[str, ...] = ()
    interval: tuple[FloatArray, FloatArray] | None = None
    is_lying: bool = False


@dataclass(frozen=True)
class Envelope:
    """The area between two curves, shaded; interrupted where they are NaN.

    Attributes
    ----------
    name : str
        In the legend.
    x, low, high : ndarray, shape (n,)
    colour : str
    """

    name: str
    x: FloatArray
    low: FloatArray
    high: FloatArray
    colour: str
    opacity: ClassVar = 0.22

    @property
    def outlines(self) -> list[tuple[FloatArray, FloatArray]]:
        """The closed outlines of its pieces: x and y of each."""
        there = np.isfinite(self.low) & np.isfinite(self.high)
        pieces = np.split(np.arange(len(there)), np.flatnonzero(np.diff(there)) + 1)
        return [
            (np.concatenate((self.x[p], self.x[p][::-1])), np.concatenate((self.low[p], self.high[p][::-1])))
            for p in pieces
            if len(p) and there[p[0]]
        ]


@dataclass(frozen=True)
class Cells:
    """A map: a cell for each value of two parameters, coloured by a figure that is written in it.

    The centres of the cells are 0, 1, 2 ... along both axes.

    Attributes
    ----------
    values : ndarray, shape (n_y, n_x)
        NaN where there is none; such a cell stays empty.
    words : tuple of tuple of str, shape (n_y, n_x)
        What is written in the cells.
    hatched : ndarray of bool, shape (n_y, n_x)
        Which cells are hatched.
    hints : tuple of tuple of str, shape (n_y, n_x)
        Text that a page shows when a cell is pointed at.
    span : (float, float), optional
        Values of the palest and the darkest colour, for several maps to compare; the extremes of this one if None.
    """

    values: FloatArray
    words: tuple[tuple[str, ...], ...]
    hatched: BoolArray
    hints: tuple[tuple[str, ...], ...]
    span: tuple[float, float] | None = None

    @property
    def colours(self) -> list[list[str]]:
        """The colour of each cell: pale for the least value, dark for the greatest."""
        there = self.values[np.isfinite(self.values)]
        low, high = self.span or ((float(there.min()), float(there.max())) if len(there) else (0.0, 0.0))
        shares = (self.values - low) / (high - low if high > low else 1.0)
        return [[_scale_colour(s) if np.isfinite(s) else "" for s in row] for row in shares]


#: From pale to dark, in even steps of lightness; the hue turns from yellow to blue.
_SCALE: Final = ((255, 247, 205), (199, 220, 170), (120, 190, 172), (62, 143, 171), (44, 90, 147), (37, 45, 100))


def _scale_colour(share: float) -> str:
    """Return the colour of a share from 0 to 1.

    Examples
    --------
    >>> _scale_colour(0.0), _scale_colour(1.0)
    ('#fff7cd', '#252d64')
    """
    place = min(max(share, 0.0), 1.0) * (len(_SCALE) - 1)
    k = min(int(place), len(_SCALE) - 2)
    mixed = (round(a + (place - k) * (b - a)) for a, b in zip(_SCALE[k], _SCALE[k + 1], strict=True))
    return "#" + "".join(f"{c:02x}" for c in mixed)


def ink_on(colour: str) -> str:
    """Return black or white, whichever has the higher contrast to a colour (WCAG 2.1, relative luminance).

    Examples
    --------
    >>> ink_on("#fff7cd"), ink_on("#252d64")
    ('#000000', '#ffffff')
    """
    linear = (
        v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4
        for v in np.array([*bytes.fromhex(colour[1:])]) / 255
    )
    luminance = sum(w * v for w, v in zip((0.2126, 0.7152, 0.0722), linear, strict=True))
    return "#000000" if (luminance + 0.05) ** 2 > 1.05 * 0.05 else "#ffffff"


@dataclass(frozen=True)
class Points:
    """Single points, each a symbol."""

    name: str
    x: FloatArray
    y: FloatArray
    symbol: Literal["circle", "x", "triangle-up"]
    colour: str = MARK
    size: float = 8.0
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ticks:
    """Vertical strokes at positions along the line, from the bottom to a share of the chart's height."""

    name: str
    x: FloatArray
    share: float = 1.0
    dash: Dash = "solid"
    colour: ClassVar = MARK


@dataclass(frozen=True)
class Band:
    """A stretch of the abscissa that is shaded over the whole height: the interval of interest."""

    start: float
    end: float
    colour: ClassVar = "#e6b428"
    edge: ClassVar = "#aa7800"
    opacity: ClassVar = 0.16


@dataclass(frozen=True)
class Level:
    """A dashed line across the chart at a value of the ordinate, or of the abscissa, with a text at its end."""

    at: float
    text: str
    is_upright: bool = False

    @property
    def colour(self) -> str:
        """Red for limits, grey for other marks."""
        return MARK if self.is_upright else LIMIT


Part = Curve | Bars | Points | Ticks | Band | Level | Envelope | Cells


@dataclass(frozen=True)
class Chart:
    """A chart and its caption.

    Attributes
    ----------
    key : str
        Identifier on the page.
    title : str
        Heading.
    x, y : Axis
    parts : tuple
        What is drawn, from the back to the front.
    note : str
        What a reader needs to know.
    height : int
        Pixels.
    group : str
        Charts of one group on a page are zoomed together along the abscissa.
    least_width : int
        Pixels; on a narrower page the reader scrolls sideways.
    """

    key: str
    title: str
    x: Axis
    y: Axis
    parts: tuple[Part, ...]
    note: str = ""
    height: int = 380
    group: str = ""
    least_width: int = 0


def gapped(x: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points of a curve that consists of separate vertical strokes."""
    return np.repeat(x, 3), np.column_stack((low, high, np.full(len(x), np.nan))).ravel()
