"""What ``summary.json`` says of a run."""

from __future__ import annotations

import platform
import re
import sys
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

from master.evaluation.contact_assessment import Assessment
from master.evaluation.filters import ForceFilter
from master.evaluation.run_events import MOST_EVENTS
from master.results.run_results import Results


def figures(done: Results) -> dict[str, Any]:
    """Return the figures, verdicts, events and energy balances for summary.json."""
    events = done.events
    return {
        "filter": done.evaluation.filter.sentence,
        "judged_by": done.evaluation.limits.title,
        "quality": [_assessed(a) for a in done.assessments()],
        "following": [asdict(f) for f in done.follower_effects],
        "uplift": [asdict(u) for u in done.uplifts],
        "events": [asdict(e) for e in events[:MOST_EVENTS]],
        "events_left_out": max(0, len(events) - MOST_EVENTS),
        "energy": [{**asdict(b), "share": b.share, "text": b.text} for b in done.balances],
    }


def _assessed(a: Assessment) -> dict[str, Any]:
    return {
        **asdict(a.quality),
        "depends_on_filter": bool(a.quality.told),
        "uplift": None if a.uplift is None else asdict(a.uplift),
        "supports": a.supports,
        "slack_droppers": a.slack,
        "spans": [asdict(s) for s in a.spans],
        "drift": a.drift,
        "early": a.early,
        "unchecked": a.unchecked,
        "criteria": [{**asdict(c), "verdict": c.word} for c in a.criteria],
        "passed": None if a.withheld else a.passed,
        "withheld": a.withheld,
    }


def filter_data(chosen: ForceFilter) -> dict[str, Any]:
    """Return a filter as a summary's settings have it."""
    known = asdict(chosen)
    return known if chosen.kind == "butterworth" else {**known, "order": None, "phase": None}


def versions() -> dict[str, str]:
    """Return the versions of what computed."""
    found = {"python": platform.python_version()}
    for name in ("openpanto", "fmpy", "numpy"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def peak_memory() -> float:
    """Return the largest memory that the process has occupied so far [MB]."""
    status = Path("/proc/self/status")
    if status.is_file():  # Linux counts in its resource usage what the program took that has started this one
        found = re.search(r"^VmHWM:\s*(\d+) kB$", status.read_text(encoding="ascii", errors="replace"), re.MULTILINE)
        if found is not None:
            return int(found[1]) / 1024.0
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)
