"""The results of a run: figures, verdict and time series, as numbers, data frames and charts."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from master.arrays import FloatArray
from master.errors import RequestError, hint
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_quality import assess
from master.evaluation.contact_signals import Signals
from master.evaluation.filters import DEFAULT, ForceFilter, Kind
from master.interface.data_frames import side_by_side, table_frame, time_frame
from master.recording.recording import Recording, header
from master.report import report_files
from master.report.charts.force_charts import force_charts
from master.report.charts.static_figure import static_figure
from master.report.comparison_page import columns
from master.report.result_tables import figure_values
from master.results import run_difference, run_results
from master.system.contacts import Contact

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

_PLACE: Final = re.compile(r"(\w+)\[(\d+)\]\.(.+)")
#: What is no length among the numbers of a place.
_PLAIN: Final = ("section",)
_FIGURE: Final = "figure"


class Results:
    """The results of a run, read from its folder: everything is taken from there once, and kept.

    `run` and `read_results` return it. Figures and forces are those of the report, evaluated with the filter and in
    the interval of interest of the run. Contacts count from 1, in the order of the line's ports.

    Attributes
    ----------
    stored : master.results.run_results.Results
        All that the folder holds; no promise is kept for this attribute.
    """

    def __init__(self, stored: run_results.Results) -> None:
        self.stored = stored

    def __repr__(self) -> str:
        figures = [
            f"{a.contact.pantograph} {a.quality.mean:.1f} N \u00b1 {a.quality.sigma:.1f} N" for a in self._judged
        ]
        return f"<Results of {self.name} in {self.folder}: {'; '.join([self.status, *figures, self.verdict])}>"

    @property
    def folder(self) -> Path:
        """The results folder."""
        return self.stored.folder

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return str(self.summary.get("scenario", self.folder.name))

    @property
    def summary(self) -> dict[str, Any]:
        """Contents of ``summary.json``: all inputs with unit and source, settings, versions, performance."""
        return self.stored.summary

    @property
    def status(self) -> str:
        """How the run ended: ``complete``, ``failed``, ``interrupted`` or ``incomplete``."""
        return str(self.summary.get("status") or "complete")

    @property
    def warnings(self) -> tuple[str, ...]:
        """What deserves a second look: of the scenario, of the FMUs, of the figures."""
        fmus = (f"{w['component']}: {w['text']}" for w in self.summary.get("warnings", []))
        own = (f"{a.contact.pantograph}: {text}" for a in self._judged for text in a.warnings)
        scenario = self.summary.get("scenario_warnings", [])
        return (*scenario, *self.summary.get("adjustments", []), *fmus, *own)

    @property
    def pantographs(self) -> tuple[str, ...]:
        """Component names of the pantographs, in the order of their contacts."""
        return tuple(c.pantograph for c in self.stored.contacts)

    @property
    def interval(self) -> tuple[float, float]:
        """Where along the track the figures are from [m]; NaN where nothing was evaluated."""
        low, high = self.stored.evaluated_interval
        return math.nan if low is None else low, math.nan if high is None else high

    @property
    def variables(self) -> dict[str, str]:
        """Units of all recorded variables by name; empty where there is none."""
        return {n: u for r in self.stored.recordings for n, u in zip(r.names, r.units, strict=True)}

    # Figures and verdict.

    @property
    def _judged(self) -> tuple[Assessment, ...]:
        return self.stored.assessments()

    def figures_of(self, contact: int = 1) -> dict[str, float]:
        """Return the figures of a contact by name with unit, as ``mean force [N]``; NaN where there is none.

        Raises
        ------
        RequestError
            If the contact has no figures.
        """
        for assessment in self._judged:
            if assessment.contact.index == contact:
                return figure_values(assessment)
        raise RequestError(f"contact {contact} has no figures: {self._why_no_figures(contact)}")

    def _why_no_figures(self, contact: int) -> str:
        known = {c.index: c.pantograph for c in self.stored.contacts}
        if contact not in known:
            listed = ", ".join(f"{index} ({name})" for index, name in known.items())
            return f"the run has contacts {listed}" if known else "the run has no contacts"
        return self.stored.not_judged or "it has no samples in the interval of interest"

    @property
    def figures(self) -> pandas.DataFrame:
        """The figures, a row each with its unit and a column for each pantograph (needs pandas)."""
        return side_by_side({a.contact.pantograph: figure_values(a) for a in self._judged}, _FIGURE)

    @property
    def passed(self) -> bool | None:
        """Whether every contact meets every limit; None if the run is not judged."""
        if not self._judged or any(a.withheld for a in self._judged):
            return None
        return all(a.passed for a in self._judged)

    @property
    def verdict(self) -> str:
        """``passed``, ``failed: `` with the limits that are not met, or ``not judged: `` with the reason."""
        reasons = [a.withheld for a in self._judged if a.withheld]
        if self.passed is None:
            why = self.stored.not_judged or "".join(reasons[:1]) or "there are no figures in the interval of interest"
            return f"not judged: {why}"
        missed = [f"{c.name} {c.value} (limit {c.limit})" for a in self._judged for c in a.criteria if not c.passed]
        return f"failed: {', '.join(missed)}" if missed else "passed"

    @property
    def criteria(self) -> pandas.DataFrame:
        """Every limit with the figure it holds for, its origin and the verdict (needs pandas)."""
        heads = ("pantograph", _FIGURE, "value", "limit", "origin", "verdict")
        rows = [
            (a.contact.pantograph, c.name, c.value, c.limit, c.origin, c.word) for a in self._judged for c in a.criteria
        ]
        return table_frame(heads, rows)

    # Time series.

    def frame(self, *patterns: str, every: float | None = None) -> pandas.DataFrame:
        """Return recorded variables over time, as ``name [unit]`` (needs pandas).

        Parameters
        ----------
        *patterns : str
            Names, in which ``*`` stands for anything; all variables if there is none. ``*[N]`` takes those of a unit,
            ``contact*[N]`` those of such a name in it.
        every : float, optional
            Interval of the recording [s]; by default the first, finest one that has variables of these names.

        Raises
        ------
        RequestError
            If no recorded variable has such a name.
        """
        if wrong := [p for p in patterns if not isinstance(p, str)]:
            raise RequestError(f"frame({wrong[0]!r}): names are texts, one by one: frame('*.uplift', '*[N]')")
        chosen = [r for r in self.stored.recordings if every is None or _is_near(_interval(r), every)]
        if not chosen:
            known = ", ".join(f"{_interval(r):g} s" for r in self.stored.recordings)
            raise RequestError(f"nothing is recorded every {every:g} s; there are recordings of every {known}")
        for recording in chosen:
            names = _names(recording, patterns)
            if names:
                units = [recording.units[recording.names.index(n)] for n in names]
                return time_frame(header(names, units), [recording.time, *(recording[n] for n in names)])
        wanted = ", ".join(f"'{p}'" for p in patterns)
        there = [name for recording in chosen for name in recording.names]
        recorded = {f"[{unit}]" for recording in chosen for unit in recording.units if unit}
        asked = any(p.endswith("]") and not p[:-1].rpartition("[")[2].isdigit() for p in patterns)
        unit = f"; units are {', '.join(sorted(recorded)) or 'not known'}" if asked else ""
        near = hint(patterns[0], there, 3) if patterns else ""
        raise RequestError(f"no recorded variable is named {wanted}{unit}{near}; 'variables' lists them all")

    def contact_force(self, contact: int = 1) -> pandas.DataFrame:
        """Return the force of a contact over time, raw and filtered, with the position (needs pandas).

        The statistics of ``filtered_force [N]`` where ``in_interval`` holds are the figures of the run.

        Raises
        ------
        RequestError
            If the run has no such contact with a recorded force.
        """
        s = self._signals(contact)
        titles = ("time [s]", "track_position [m]", "force [N]", "filtered_force [N]", "in_interval")
        return time_frame(titles, (s.time, s.position, s.raw, s.filtered, s.inside))

    def _signals(self, contact: int) -> Signals:
        for s in self.stored.signals:
            if s.contact.index == contact:
                return s
        known = ", ".join(str(s.contact.index) for s in self.stored.signals) or "none"
        raise RequestError(f"the run has no contact {contact} with a recorded force (contacts with one: {known})")

    # The line, and what happened on it.

    def geometry(self, kind: str = "support", component: str | None = None) -> pandas.DataFrame:
        """Return places and lengths of the line at rest, a row for each support or dropper (needs pandas).

        Parameters
        ----------
        kind : str
            ``support`` or ``dropper``, or what else the line's FMU numbers in its calculated parameters.
        component : str, optional
            The line; by default the first one.

        Raises
        ------
        RequestError
            If the FMU of the line does not give such places.
        """
        lines = [name for name in self.stored.geometry if component in (None, name)]
        found: dict[int, dict[str, float]] = {}
        kinds: dict[str, None] = {}
        for key, value in self.stored.geometry[lines[0]].items() if lines else ():
            if m := _PLACE.fullmatch(key):
                kinds[m[1]] = None
                if m[1] == kind:
                    title = m[3] if m[3] in _PLAIN else f"{m[3]} [m]"
                    found.setdefault(int(m[2]), {})[title] = value
        if not found:
            known = f"known: {', '.join(kinds)}" if kinds else "its FMU gives none"
            raise RequestError(f"no geometry of '{kind}' for {component or 'the line'}; {known}")
        heads = list(dict.fromkeys(head for row in found.values() for head in row))
        rows = [(i, *(found[i].get(head, math.nan) for head in heads)) for i in sorted(found)]
        return table_frame([kind, *heads], rows, kind)

    @property
    def uplifts(self) -> pandas.DataFrame:
        """Largest uplift of every support in the whole run, where and when (needs pandas)."""
        rows = [
            (u.support, math.nan if u.x is None else u.x, u.maximum, u.time, u.component) for u in self.stored.uplifts
        ]
        return table_frame(("support", "x [m]", "uplift [m]", "time [s]", "line"), rows, "support")

    @property
    def events(self) -> pandas.DataFrame:
        """What happened when: losses of contact, slack droppers, energy that does not balance (needs pandas)."""
        heads = ("time [s]", "event", "what", "duration [s]", "position [m]")
        rows = [
            (e.time, e.kind, e.what, e.duration, math.nan if e.position is None else e.position)
            for e in self.stored.events
        ]
        return table_frame(heads, rows)

    @property
    def spans(self) -> pandas.DataFrame:
        """Figures of the filtered force span by span (needs pandas)."""
        heads = ("pantograph", "start [m]", "end [m]", "mean [N]", "sigma [N]", "minimum [N]", "maximum [N]", "inside")
        rows = [
            (a.contact.pantograph, s.start, s.end, s.mean, s.sigma, s.minimum, s.maximum, s.is_inside)
            for a in self._judged
            for s in a.spans
        ]
        return table_frame(heads, rows)

    # To look at.

    def force_figure(self, contact: int | None = None) -> Figure:
        """Return the contact force over the track, of one contact or one below the other, as Matplotlib draws it."""
        signals = self.stored.signals if contact is None else (self._signals(contact),)
        if not signals:
            raise RequestError("the run has no recorded contact force to draw")
        return static_figure(force_charts(self.stored, signals))

    def write_report(self) -> Path:
        """Write ``report.html`` and its charts into the results folder and return the report's path."""
        return report_files.write(self.stored)


def read_results(folder: str | Path) -> Results:
    """Return the results of a run, read back from its folder.

    Parameters
    ----------
    folder : str or Path
        A results folder, made by `run` or the command line.

    Raises
    ------
    MasterError
        If it is not one, a file in it is damaged, or a run is writing there.

    Examples
    --------
    >>> read_results("no_such_folder")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    master.errors.MasterError: no_such_folder is not a results folder: it has no summary.json...
    """
    if not isinstance(folder, str | Path):
        raise RequestError(f"read_results({folder!r}): give the path of a results folder")
    return Results(run_results.read(Path(folder)))


def compare(*results: Results | str | Path) -> pandas.DataFrame:
    """Return the figures of several runs side by side, a column each (needs pandas).

    Runs are results, or their folders. What makes them hard to compare (other filters, intervals, limits) is in
    ``frame.attrs["notes"]``.

    Raises
    ------
    MasterError
        If fewer than two contacts have figures, or something is not results.
    """
    if not results:
        raise RequestError("nothing to compare: give the results of two runs, or of one with several pantographs")
    if wrong := [r for r in results if not isinstance(r, Results | str | Path)]:
        text = f"compare: a {type(wrong[0]).__name__} is neither results nor a results folder"
        raise RequestError(f"{text}; give the runs one by one: compare(one, other)")
    runs = [(r if isinstance(r, Results) else read_results(r)).stored for r in results]
    frame = side_by_side({c.name: figure_values(c.assessment) for c in columns(runs)}, _FIGURE)
    frame.attrs["notes"] = run_difference.setting_notes(runs)
    return frame


def contact_figures(
    position: Sequence[float] | FloatArray,
    force: Sequence[float] | FloatArray,
    step: float,
    *,
    interval: tuple[float | None, float | None] = (None, None),
    low_pass: Kind = DEFAULT.kind,
    cutoff: float = DEFAULT.cutoff,
) -> dict[str, float]:
    """Return the figures of any contact force, measured or of another tool, as those of a run are made.

    Parameters
    ----------
    position, force : array_like, shape (n,)
        Position along the track [m] and force [N], not filtered, at equal steps.
    step : float
        Time between two samples [s].
    interval : (float or None, float or None)
        Interval of interest [m]; where it is open, from 1 s after the first contact to the end.
    low_pass : str
        ``butterworth`` or ``fft``.
    cutoff : float
        Its cut-off frequency [Hz].

    Raises
    ------
    RequestError
        If the arrays do not fit each other, or fewer than two samples lie in the interval.

    Examples
    --------
    >>> import math
    >>> x = [0.05 * i for i in range(4000)]  # 180 km/h, a sample every millisecond
    >>> force = [150.0 + 20.0 * math.sin(2.0 * math.pi * 0.001 * i) for i in range(4000)]  # 1 Hz
    >>> figures = contact_figures(x, force, 0.001, interval=(50.0, 150.0))
    >>> round(figures["mean force [N]"], 1), round(figures["maximum [N]"], 1)
    (150.0, 170.0)
    """
    try:
        places, forces = np.asarray(position, dtype=np.float64), np.asarray(force, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RequestError(f"position and force must be rows of numbers ({error})") from error
    if places.ndim != 1 or places.shape != forces.shape:
        raise RequestError(
            f"position and force must be equally long rows, not of shapes {places.shape}, {forces.shape}"
        )
    if np.ndim(step) or step is None or isinstance(step, str):
        raise RequestError(
            "step must be one number, the time between two samples in s: position, force, step in this order"
        )
    if not (np.isfinite(places).all() and np.isfinite(forces).all() and 0.0 < step < math.inf):
        raise RequestError("position, force and step must be finite numbers, and the step greater than 0 s")
    if not 0.0 < 2.0 * cutoff * step < 1.0:
        raise RequestError(
            f"cutoff {cutoff:g} Hz must lie between 0 and half the sampling frequency, {0.5 / step:g} Hz"
        )
    quality = assess(forces, places, step, ForceFilter(low_pass, cutoff=cutoff), interval)
    if quality is None:
        raise RequestError("fewer than two samples lie in the interval of interest")
    found = figure_values(Assessment(Contact(1, "", "", ""), quality, ()))
    return {name: value for name, value in found.items() if not math.isnan(value)}


def _names(recording: Recording, patterns: Iterable[str]) -> list[str]:
    """Return the names that fit any of the patterns, in the order of the recording; all of them if there is none."""
    fitting = {n for p in patterns for n in (recording.matching(p) or _of_unit(recording, p))}
    return [n for n in recording.names if n in fitting] if patterns else list(recording.names)


def _of_unit(recording: Recording, pattern: str) -> list[str]:
    """Return the names that fit a pattern with a unit, ``name [N]``: the index of an array is a number instead."""
    found = re.fullmatch(r"(.*?) ?\[([^\[\]*]*[^\[\]*\d][^\[\]*]*)\]", pattern)
    if found is None:
        return []
    units = dict(zip(recording.names, recording.units, strict=True))
    return [name for name in recording.matching(found[1]) if units[name] == found[2]]


def _interval(recording: Recording) -> float:
    time = recording.time
    return float(time[-1] - time[0]) / (len(time) - 1) if len(time) > 1 else math.nan


def _is_near(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=1e-3)
