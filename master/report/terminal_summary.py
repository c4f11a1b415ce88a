"""What a run prints at its end, and the terminal as a place for text from others: shown, never obeyed.

Names, titles and messages come from FMUs and files of unknown origin. A control sequence in one of them could move the
cursor, colour a failed verdict green or set the clipboard; so every character that does not print is written as its
escape. Rich adds its own sequences, for colours, after that, and these stay.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from master.errors import printable
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_signals import EvaluationSettings
from master.report.charts.output_charts import has_contacts, outputs_table
from master.report.result_tables import (
    FILTER_HEADS,
    calibration_line,
    figures_table,
    filter_rows,
    plain_table,
    uplift_line,
    verdict_table,
)
from master.report.run_inputs import residual_rows
from master.results.run_results import Results

WIDTH: Final = 80


class Terminal(Console):
    """A console that shows characters that do not print instead of sending them."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render, and write what does not print as escapes."""
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(printable(segment.text), segment.style)


def printable_json(text: str) -> str:
    r"""Return JSON with the same contents in which every character prints.

    Examples
    --------
    >>> print(printable_json('{"said": "\x9b2J"}'))
    {"said": "\u009b2J"}
    """
    return "".join(c if c.isprintable() or c == "\n" else json.dumps(c)[1:-1] for c in text)


def show_run(done: Results) -> None:
    """Print figures, verdicts and what else a reader has to know of a run."""
    console = Terminal(width=WIDTH, highlight=False)
    assessments = done.assessments()
    if assessments:
        heads = [a.contact.pantograph for a in assessments]
        console.print(figures_table(assessments, heads, [done.evaluation.filter]))
    for assessment in assessments:
        _show_verdict(console, assessment, done.evaluation)
    if not has_contacts(done):
        console.print(outputs_table(done))
    elif done.not_judged:
        console.print(f"not judged: {done.not_judged}", style="yellow", markup=False, soft_wrap=True)
    elif not assessments:
        console.print("no contact-quality figures: the run has no contact force in the interval of interest")
    for line in filter(None, (calibration_line(done), uplift_line(done))):
        console.print(line, markup=False, soft_wrap=True)
    for effect in done.follower_effects:
        console.print(effect.sentence, markup=False, soft_wrap=True)
    for line in _closing_lines(done):
        console.print(line, markup=False, soft_wrap=True)


def _show_verdict(console: Console, assessment: Assessment, settings: EvaluationSettings) -> None:
    """Print the verdict of a contact, and what makes it uncertain."""
    if assessment.withheld:
        text = f"{assessment.contact.pantograph}: not judged: {assessment.withheld}"
        console.print(text, style="yellow", markup=False, soft_wrap=True)
    else:
        console.print(verdict_table(assessment, settings.limits))
    if rows := filter_rows(assessment.quality, settings.filter):
        console.print(f"the extremes of {assessment.contact.pantograph} depend on the filter:", markup=False)
        console.print(plain_table(FILTER_HEADS, rows))
    for warning in assessment.warnings:
        console.print(f"warning: {assessment.contact.pantograph}: {warning}", markup=False)


def _closing_lines(done: Results) -> list[str]:
    performance = done.summary["performance"]
    lines = [
        f"wall time {performance['wall_time']:.2f} s, "
        f"initialisation {performance['initialisation_time']:.2f} s, "
        f"real-time factor {performance['real_time_factor']:.2f}, {performance['peak_memory']:.0f} MB",
    ]
    lines += [f"{name}: {text}" for name, text in residual_rows(done.summary)]
    lines += _energy_lines(done.summary["energy"])
    if tolerance := tolerance_words({c["name"]: c.get("tolerance") for c in done.summary.get("components", [])}):
        lines.append(tolerance.removeprefix(", "))
    lines += _definition_lines(done.summary.get("components", []))
    return [*lines, *_punctuality_lines(performance.get("real_time")), f"results in {done.folder}"]


def _definition_lines(components: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return in one line which definition files the run was computed from."""
    found = [f"{c['name']} {_nearby(c['definition'])}" for c in components if c.get("definition")]
    return [f"definitions: {', '.join(found)}"] if found else []


def _nearby(file: str) -> str:
    """Return the path of a file relative to the working directory, if it lies in it."""
    path = Path(file)
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else file


def _energy_lines(found: Sequence[dict[str, Any]]) -> list[str]:
    """Return the drifts of the energy balances in one line, and a warning for each that is too large."""
    drifts = ", ".join(f"{b['what']} {b['share']:.1g} of {b['passed']:.4g} J" for b in found)
    beyond = [b for b in found if b["exceeded"] is not None]
    warnings = [f"warning: the energy of {b['what']} does not balance: {b['text']}" for b in beyond]
    return [f"energy drift: {drifts}", *warnings] if found else []


def _punctuality_lines(found: dict[str, Any] | None) -> list[str]:
    """Return in words how a run kept pace with the wall clock."""
    if found is None:
        return []
    jitter, late = found["start_jitter"], found["lateness"]
    return [
        f"real time x {found['factor']:g}: {found['missed']} of {found['steps']} deadlines missed "
        f"({100.0 * found['missed_share']:.3g} %), results late by up to {1e3 * late['maximum']:.3g} ms; "
        f"steps took {1e3 * found['mean_step']:.3g} ms, the longest {1e3 * found['longest_step']:.3g} ms",
        f"steps began late by {1e3 * jitter['mean']:.3g} ms on average, {1e3 * jitter['percentile_99']:.3g} ms at "
        f"99 %, {1e3 * jitter['maximum']:.3g} ms at most",
    ]


def tolerance_words(tolerances: Mapping[str, float | None]) -> str:
    """Return in words the tolerances that the FMUs of components are given; empty if there are none."""
    values = set(tolerances.values())
    if values <= {None}:
        return ""
    if len(values) == 1:
        return f", tolerance {values.pop():g} for all FMUs"
    return ", tolerance " + ", ".join(
        f"{value:g} for {name}" for name, value in tolerances.items() if value is not None
    )
