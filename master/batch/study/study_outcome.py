"""The results of a study so far, and as rows of tables and files."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import Any, Final

from master.batch.assessment_figures import FIGURES, verdict_of
from master.batch.batch_session import BatchState
from master.batch.study.family import Family, Interval, Variant
from master.batch.study.study_evaluation import StudyEntry, entries
from master.results.run_results import Results
from master.safety.safe_files import safe_cell

#: Version of ``study.json`` and ``study.csv``; files without one are of version 1.
FORMAT: Final = 2


@dataclass(frozen=True)
class VariantResult:
    """A variant that was run.

    Attributes
    ----------
    name : str
    results : Results
    """

    name: str
    results: Results


@dataclass(frozen=True)
class StudyOutcome(BatchState):
    """The state of a study.

    Attributes
    ----------
    family : Family
    done : tuple of VariantResult
        In the order of the table.
    failures : dict
        Reasons why variants failed, by name.
    """

    family: Family
    done: tuple[VariantResult, ...] = ()
    failures: Mapping[str, str] = field(default_factory=dict)

    def entries(self, interval: Interval) -> tuple[StudyEntry, ...]:
        """Return the figures of all pantographs of all variants in an interval."""
        return tuple(e for d in self.done for e in entries(d.name, d.results, interval))

    @property
    def all_entries(self) -> tuple[StudyEntry, ...]:
        """The figures of all pantographs of all variants, interval by interval."""
        return tuple(e for interval in self.family.settings.interval for e in self.entries(interval))


def shown(value: float | None, decimals: int) -> str:
    """Return a figure as text."""
    return "-" if value is None else f"{value:.{decimals}f}"


def filters(outcome: StudyOutcome) -> tuple[str, ...]:
    """Return the filters that low-passed the forces: one, or several if the settings of the runs differ."""
    return tuple(dict.fromkeys(d.results.evaluation.filter.sentence for d in outcome.done))


def judged_by(found: Sequence[VariantResult]) -> str:
    """Return the limits by which the variants are judged."""
    return "; ".join(dict.fromkeys(d.results.evaluation.limits.title for d in found)) or "EN 50367"


def filter_remarks(found: Sequence[StudyEntry]) -> list[str]:
    """Return remarks on extremes and verdicts that depend on the filter, with the figures of other filters."""
    remarks = []
    for e in found:
        who = e.name
        others = "; ".join(
            f"maximum {f.maximum:.0f}, minimum {f.minimum:.0f} N with {f.filter}" for f in e.quality.filter_dependent
        )
        remarks += [f"{who}: {others}"] if others else []
        remarks += [f"{who}: {c.name}: {c.remark}" for c in e.assessment.criteria if c.remark and not c.is_at_limit]
        remarks += [f"{who}: {warning}" for warning in e.assessment.warnings]
    return remarks


def differences(found: Sequence[StudyEntry]) -> list[tuple[str, str, str, tuple[float, float, float]]]:
    """Return differences between pantographs: sigma, maximum and minimum of one minus those of the other [N].

    Each follower is compared with the pantograph ahead, and each of several with the variant of a single pantograph
    whose name ends alike (``single, low damping`` for ``31 m, low damping``), if there is just one. Variants with one
    pantograph each are not compared: they differ in the parameter that was swept.
    """
    alone = [e for e in found if _is_single(e, found)]
    kinds = [_kind(e.variant) for e in alone]
    singles = {_kind(e.variant): e for e in alone if kinds.count(_kind(e.variant)) == 1}
    rows = []
    for variant in dict.fromkeys(e.variant for e in found):
        own = [e for e in found if e.variant == variant]
        rows += [_beside(b, a, a.pantograph) for a, b in pairwise(own)]
        single = singles.get(_kind(variant)) if len(own) > 1 else None
        rows += [_beside(e, single, single.variant) for e in own if single is not None]
    return rows


def _is_single(entry: StudyEntry, found: Sequence[StudyEntry]) -> bool:
    return sum(e.variant == entry.variant for e in found) == 1


def _kind(variant: str) -> str:
    return variant.partition(",")[2].strip()


def _beside(one: StudyEntry, other: StudyEntry, name: str) -> tuple[str, str, str, tuple[float, float, float]]:
    a, b = one.assessment.quality, other.assessment.quality
    change = (a.sigma - b.sigma, a.maximum - b.maximum, a.minimum - b.minimum)
    return one.variant, one.pantograph, name, change


def as_csv(outcome: StudyOutcome) -> str:
    """Return every figure of the study as a table."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = [f"{title} [{unit}]" for title, unit, _, _ in FIGURES]
    sharing = ["both wires from [m]", "both wires to [m]", "both wires [s]", "least total force [N]", "losses per wire"]
    swept = _swept(outcome.family.variants)
    writer.writerow(["variant", "interval", "pantograph", *heads, "EN 50367", "filter", *sharing, *swept])
    filtered = {d.name: d.results.evaluation.filter.short for d in outcome.done}
    for interval in outcome.family.settings.interval:
        for e in outcome.entries(interval):
            values = [shown(get(e.assessment), 6) for _, _, get, _ in FIGURES]
            named = map(safe_cell, (e.variant, interval.name, e.pantograph))
            given = _values_of(outcome.family, e.variant)
            own = [given.get(name, "") for name in swept]
            cells = [*values, verdict_of(e.assessment), filtered[e.variant], *_sharing_cells(e), *own]
            writer.writerow([*named, *cells])
    return text.getvalue()


def _swept(variants: Sequence[Variant]) -> list[str]:
    """Return the columns of the table of variants that hold any value, in their order."""
    return list(dict.fromkeys(name for v in variants for name in _values(v)))


def _values_of(family: Family, name: str) -> dict[str, str]:
    """Return the values of a variant as written in its table."""
    return next((_values(v) for v in family.variants if v.name == name), {})


def _values(variant: Variant) -> dict[str, str]:
    times = {"stop": variant.stop, "step": variant.step}
    return {**variant.values, **{name: f"{value:g}" for name, value in times.items() if value is not None}}


def _sharing_cells(e: StudyEntry) -> list[str]:
    s = e.sharing
    if s is None:
        return [""] * 5
    numbers = (s.start, s.end, s.duration, s.least_force)
    return [*(f"{v:.6g}" for v in numbers), " ".join(map(str, s.losses))]


def as_data(outcome: StudyOutcome) -> dict[str, Any]:
    """Return the contents of ``study.json``."""
    return {
        "format": FORMAT,
        "filter": list(filters(outcome)),
        "judged_by": judged_by(outcome.done),
        "study": outcome.family.name,
        "title": outcome.family.settings.title,
        "status": outcome.status,
        "date": outcome.date,
        "versions": dict(outcome.versions),
        "variants": [
            {"name": d.name, "folder": d.results.folder.name, "values": _values_of(outcome.family, d.name)}
            for d in outcome.done
        ],
        "failures": dict(outcome.failures),
        "figures": [_entry_data(e) for e in outcome.all_entries],
    }


def _entry_data(e: StudyEntry) -> dict[str, Any]:
    figures = {f"{title} [{unit}]": get(e.assessment) for title, unit, get, _ in FIGURES}
    return {
        "variant": e.variant,
        "interval": e.interval.name,
        "pantograph": e.pantograph,
        **figures,
        "other_filters": [asdict(f) for f in e.quality.others],
        "drift": e.assessment.drift,
        "early": e.assessment.early,
        "unchecked": e.assessment.unchecked,
        "withheld": e.assessment.withheld,
        "criteria": [asdict(c) for c in e.assessment.criteria],
        "sharing": asdict(e.sharing) if e.sharing is not None else None,
    }
