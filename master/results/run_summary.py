"""The contents of ``summary.json``: what a run was, how it ended, what it took, its figures."""

from __future__ import annotations

import platform
import re
import sys
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from master.coupling.macro_steps import RunOutcome
from master.coupling.stopwatch import Timing
from master.evaluation.contact_assessment import Assessment
from master.evaluation.filters import ForceFilter
from master.evaluation.run_events import MOST_EVENTS
from master.recording.continuation import Continuation
from master.results.results_folder import FORMAT, GENERATOR
from master.results.run_results import Results
from master.system.components import Component, System, Variable


def describe(system: System, run: str) -> dict[str, Any]:
    """Return what is known of a run at its beginning: identity, settings, components and contacts."""
    return {
        "generator": GENERATOR,
        "format": FORMAT,
        "run": run,
        "scenario": system.name,
        "title": system.title,
        **({"changes": dict(system.changes)} if system.changes else {}),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": versions(),
        "settings": {
            "start": system.start,
            "stop": system.stop,
            "step": system.step,
            **system.settings.model_dump(mode="json"),
        },
        "components": [_component(c) for c in system.components],
        "contacts": [c.as_data() for c in system.contacts],
    }


def _component(component: Component) -> dict[str, Any]:
    fmu = component.fmu
    return {
        "name": component.name,
        "fmu": fmu.path.name,
        "description": fmu.description,
        "guid": fmu.guid,
        "sha256": fmu.sha256,
        "tool": fmu.tool,
        "definition": fmu.definition,
        "parameters": component.parameters,
        "tolerance": component.tolerance,
        "inputs": [_input(component, v) for v in fmu.variables.values() if v.causality == "parameter"],
    }


def _input(component: Component, variable: Variable) -> dict[str, Any]:
    return {
        "name": variable.name,
        "value": component.parameters.get(variable.name, variable.start),
        "unit": variable.unit,
        "description": variable.description,
        "changed": variable.name in component.parameters,
    }


def ending(outcome: RunOutcome) -> dict[str, Any]:
    """Return how a run ended."""
    return {
        "status": outcome.status,
        "reason": str(outcome.error) if outcome.error else "",
        "steps": outcome.steps,
        "time_reached": outcome.time,
    }


def origin(continuation: Continuation | None) -> dict[str, Any]:
    """Return where a run continued from, if it did."""
    if continuation is None:
        return {}
    c = continuation
    return {"resumed": {"file": c.file, "time": c.checkpoint.time, "renewed": list(c.renewed)}}


def performance(timing: Timing, simulated: float) -> dict[str, Any]:
    """Return what a run of this much simulated time [s] took."""
    return {
        "initialisation_time": timing.initialisation,
        "wall_time": timing.stepping,
        "real_time_factor": simulated / timing.stepping if timing.stepping > 0 else 0.0,
        "peak_memory": peak_memory(),
    }


def figures(done: Results) -> dict[str, Any]:
    """Return figures, verdicts, events and energy balances."""
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
        "depends_on_filter": bool(a.quality.filter_dependent),
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
    """Return a filter as it stands in the settings of a summary."""
    known = asdict(chosen)
    return known if chosen.kind == "butterworth" else {**known, "order": None, "phase": None}


def versions() -> dict[str, str]:
    """Return the versions of the software that computed."""
    return dict(_versions())


@cache  # each look-up keeps what it has found in folders that FMUs have changed: a leak over many runs
def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for name in ("openpanto", "fmpy", "numpy"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def peak_memory() -> float:
    """Return the peak memory of the process so far [MB]."""
    status = Path("/proc/self/status")
    if status.is_file():  # the resource usage of Linux includes what the program that started this one took
        found = re.search(r"^VmHWM:\s*(\d+) kB$", status.read_text(encoding="ascii", errors="replace"), re.MULTILINE)
        if found is not None:
            return int(found[1]) / 1024.0
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)
