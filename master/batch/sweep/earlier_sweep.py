"""What lies in a sweep's folder already: a sweep that this one goes on with or extends, or another, which stays.

The table of a sweep is written anew by the next one in its folder. That is meant where the next one holds all that it
held: the same sweep again, or more values of the same parameters. Anything else would lose rows in silence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from master.batch.sweep.sweep_plan import SweepPlan, SweepRequest, make_plan
from master.batch.sweep.swept_systems import SweepRun, make_runs
from master.errors import MasterError
from master.results.results_folder import contents_of
from master.system.components import System

#: What of a request changes no figure.
_NO_FIGURE: Final = ("keep", "engine", "check")
#: What is not given has these values: a request that names them all is none that a user could make.
_DEFAULTS: Final = SweepRequest.read({}).model_dump(mode="json")
_ELSEWHERE: Final = "choose another with --out"


def run_settings(base: System, plan: SweepPlan) -> dict[str, Any]:
    """Return what all runs of a sweep have in common besides values: ``step`` [s], ``scheme``, ``tolerance``.

    The step is left out where it is varied; the tolerance is that of every component that has one, by its name.
    """
    step = {} if any(p.name == "step" for p in plan.parameters) else {"step": base.step}
    tolerance = {c.name: c.tolerance for c in base.components if c.tolerance is not None}
    return {**step, "scheme": base.settings.coupling.scheme, "tolerance": tolerance}


def check_earlier(path: Path, base: System, request: SweepRequest, plan: SweepPlan, runs: Sequence[SweepRun]) -> None:
    """Refuse a folder whose sweep is another one than that which is to be made.

    Parameters
    ----------
    path : Path
        ``sweep.json``, which need not be there.
    base : System
        Of the scenario as it is.
    request, plan, runs
        Of the sweep that is to be made.

    Raises
    ------
    MasterError
        If the sweep there has other settings, or runs that this one has not.
    """
    found = contents_of(path)
    if not found.get("finished"):
        return
    settings = found.get("settings")
    here = run_settings(base, plan)
    if isinstance(settings, dict) and (text := _other(_texts(settings), _texts(here))):
        raise MasterError(f"{path.parent} holds a sweep with {text}; {_ELSEWHERE}")
    setting = found.get("setting")
    changes = setting.get("changes", {}) if isinstance(setting, dict) else {}
    if text := _other(_changes(changes), _changes(base.changes)):
        raise MasterError(f"{path.parent} holds a sweep with {text}; {_ELSEWHERE}")
    if text := _lost(found.get("request"), base, request, runs):
        told = ", ".join(str(p.get("name")) for p in found.get("parameters", ()))
        raise MasterError(
            f"{path.parent} holds another sweep, over {told}; {text}, and its table would be replaced; {_ELSEWHERE}"
        )


def _lost(earlier: object, base: System, request: SweepRequest, runs: Sequence[SweepRun]) -> str:
    """Return how many runs of an earlier request are not among these, empty if all are, whatever its FMUs were."""
    if not isinstance(earlier, dict) or _asked(earlier) == _asked(request.model_dump(mode="json", exclude_none=True)):
        return ""
    try:
        old = SweepRequest.read({name: value for name, value in earlier.items() if value != _DEFAULTS.get(name)})
        others = make_runs(base, make_plan(base, old), old)
    except MasterError:  # its table is gone, or its faults are not those of this line
        return "its runs are not those of this one"
    missing = len({r.key for r in others} - {r.key for r in runs})
    return f"{missing} of its {len(others)} runs are not among those of this one" if missing else ""


def _asked(request: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in request.items() if name not in _NO_FIGURE}


def _texts(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return settings as a reader has them, by what they are of."""
    found = {}
    if "step" in settings:
        found["step"] = f"step {settings['step']} s"
    found["scheme"] = f"scheme {settings.get('scheme')}"
    of = settings.get("tolerance")
    for name, value in of.items() if isinstance(of, dict) else ():
        found[f"tolerance of {name}"] = f"tolerance {value:g} of {name}"
    return found


def _changes(changes: Mapping[str, str]) -> dict[str, str]:
    return {f"--set {name}": f"--set {name}={value}" for name, value in changes.items()}


def _other(there: Mapping[str, str], here: Mapping[str, str]) -> str:
    """Return the first thing in which two sweeps differ, empty if none."""
    for name in dict.fromkeys([*there, *here]):
        old, new = there.get(name, f"no {name}"), here.get(name, f"no {name}")
        if old != new:
            return f"{old}, this one has {new}"
    return ""
