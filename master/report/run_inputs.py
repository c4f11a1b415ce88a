"""The inputs of a run with their provenance: parameters, FMUs, versions and settings."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from master.results.kept_definitions import differing_definitions
from master.results.run_results import Results
from master.ssp.run_settings import OPTIONS

_SOURCE: Final = re.compile(r"\s*\[(?P<source>[^\[\]]*)\]\s*$")


@dataclass(frozen=True)
class Input:
    """One parameter of a component.

    Attributes
    ----------
    name, value, unit, description, source : str
        As shown; the source is the last bracket of the FMU's description.
    changed : bool
        Whether the scenario or the command line set it; otherwise it is the FMU's start value.
    """

    name: str
    value: str
    unit: str
    description: str
    source: str
    changed: bool


def inputs_of(component: Mapping[str, Any]) -> list[Input]:
    """Return the parameters of a component in summary.json; of older runs only those that were set."""
    listed: Sequence[Mapping[str, Any]] = component.get("inputs") or [
        {"name": n, "value": v, "changed": True} for n, v in component.get("parameters", {}).items()
    ]
    return [_input(entry) for entry in listed]


def _input(entry: Mapping[str, Any]) -> Input:
    description, source = split_source(str(entry.get("description", "")))
    changed = bool(entry.get("changed"))
    if changed:
        source = "scenario or command line" + (f"; the FMU's own: {source}" if source else "")
    unit = str(entry.get("unit", ""))
    return Input(entry["name"], number(entry.get("value")), "" if unit == "1" else unit, description, source, changed)


def split_source(description: str) -> tuple[str, str]:
    """Split a description into its text and the source in its last bracket.

    Examples
    --------
    >>> split_source("tension [Table 5.2]")
    ('tension', 'Table 5.2')
    >>> split_source("speed")
    ('speed', '')
    """
    match = _SOURCE.search(description)
    return (description[: match.start()], match["source"]) if match else (description, "")


def number(value: Any) -> str:
    """Return a value as text, with no more digits than are meant.

    Examples
    --------
    >>> number("6.549999999999999e-05"), number(83.3333333333333), number(True), number(None)
    ('6.55e-05', '83.3333', 'True', '-')
    """
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value)
    try:
        return f"{float(value):.6g}"
    except (TypeError, ValueError):
        return str(value)


def unequal_inputs(runs: Sequence[Results]) -> list[tuple[str, ...]]:
    """Return what is not the same in all runs: name, then one value per run; definitions first, each value once.

    A parameter that has the value of its definition is not listed beside the definition's key of that name.
    """
    summaries = [run.summary for run in runs]
    definitions = differing_definitions(runs)
    given = {name for s in summaries for name, i in _parameters(s).items() if i.changed}
    told = {name.replace(": ", ".", 1) for name, *_ in definitions}
    inputs = [row for row in differing_inputs(summaries) if row[0] in given or row[0].partition(" [")[0] not in told]
    return [*definitions, *inputs]


def differing_inputs(runs: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """Return what is not the same in all runs: name with unit, then one value per run.

    First what the scenario is and how it is coupled, then the parameters that a scenario or a command line set.
    """
    parameters = [_parameters(summary) for summary in runs]
    are_set = {name for table in parameters for name, i in table.items() if i.changed}
    values = [{name: i.value for name, i in table.items()} for table in parameters]
    first = [{name: value for name, value in table.items() if name in are_set} for table in values]
    rows = [row for tables in (list(map(_settings, runs)), first, values) for row in _rows(tables)]
    return list(dict.fromkeys(row for row in rows if len(set(row[1:])) > 1))


def _rows(tables: Sequence[Mapping[str, str]]) -> list[tuple[str, ...]]:
    names = dict.fromkeys(name for table in tables for name in table)
    return [(name, *(table.get(name, "-") for table in tables)) for name in names]


def _parameters(summary: Mapping[str, Any]) -> dict[str, Input]:
    return {
        f"{component['name']}.{i.name}" + (f" [{i.unit}]" if i.unit else ""): i
        for component in summary.get("components", [])
        for i in inputs_of(component)
    }


def _settings(summary: Mapping[str, Any]) -> dict[str, str]:
    settings = summary.get("settings", {})
    coupling = settings.get("coupling", {})
    found = {"scenario": str(summary.get("scenario") or "-")}
    for component in summary.get("components", []):
        found[component["name"]] = component.get("description") or "-"
        found[f"FMU of {component['name']}"] = f"{component.get('fmu', '-')} ({component.get('sha256', '-')[:8]})"
    found |= {"scheme": str(coupling.get("scheme", "-")), "step [s]": number(settings.get("step"))}
    found |= {f"scheme, {name}": text for name, text in scheme_options(coupling)}
    for section in ("interval", "filter", "limits"):
        found |= {f"{section}, {k}": number(v) for k, v in (settings.get(section) or {}).items() if v is not None}
    return found


def scheme_options(coupling: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the options of a run's coupling scheme, as name and text.

    Examples
    --------
    >>> scheme_options({"scheme": "gauss-seidel", "order": ["pantograph", "catenary"], "tolerance": 1e-8})
    [('order', 'pantograph catenary')]
    """
    names = OPTIONS.get(coupling.get("scheme", ""), ())
    return [(name.replace("_", " "), _option(coupling[name])) for name in names if name in coupling]


def _option(value: Any) -> str:
    return (" ".join(map(str, value)) or "as in the scenario") if isinstance(value, list | tuple) else number(value)


def quality_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return rows on the accuracy and the speed of the computation."""
    settings, performance = summary.get("settings", {}), summary.get("performance", {})
    coupling = settings.get("coupling", {})
    rows = [
        ("coupling scheme", str(coupling.get("scheme", "-"))),
        ("macro step", f"{1e3 * (settings.get('step') or 0.0):g} ms"),
    ]
    tolerances = {c["name"]: c["tolerance"] for c in summary.get("components", []) if c.get("tolerance") is not None}
    rows += [(f"tolerance passed to the FMU of {name}", f"{value:g}") for name, value in tolerances.items()]
    rows += [(f"{name} of the scheme", text) for name, text in scheme_options(coupling)]
    rows += [("adjusted", text) for text in summary.get("adjustments", [])]
    rows += residual_rows(summary)
    rows += [(f"energy drift, {b['what']}", b["text"]) for b in summary.get("energy", [])]
    if performance:
        rows += _performance_rows(performance)
    return rows


def residual_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return for every contact the energy that the coupling added, positive, or took away.

    Examples
    --------
    >>> residual_rows({"interface_power": [{"contact": 1, "energy": 0.5, "transferred": 20.0, "rms": 1.0}]})
    [('interface residual, contact 1', '0.5 J of 20 J exchanged (2.50 %), rms 1 W')]
    """
    rows = []
    for p in summary.get("interface_power", []):
        text = "not finite: the values exchanged were too large"
        if None not in (p["energy"], p["transferred"], p["rms"]):
            share = 100.0 * p["energy"] / p["transferred"] if p["transferred"] else 0.0
            text = f"{p['energy']:.3g} J of {p['transferred']:.4g} J exchanged ({share:.2f} %), rms {p['rms']:.3g} W"
        rows.append((f"interface residual, contact {p['contact']}", text))
    return rows


def _performance_rows(performance: Mapping[str, Any]) -> list[tuple[str, str]]:
    wall = performance.get("wall_time", 0.0)
    rows = [
        ("wall time", f"{wall:.2f} s, initialization {performance.get('initialisation_time', 0.0):.2f} s"),
        ("real-time factor", f"{performance.get('real_time_factor', 0.0):.2f} (simulated over wall time)"),
    ]
    steps = performance.get("component_time", {})
    rows += [(f"time in {name}", f"{t:.2f} s ({100.0 * t / wall if wall else 0.0:.0f} %)") for name, t in steps.items()]
    paced = performance.get("real_time")
    # Isolated components step at the same time, and a paced run waits: the difference would be meaningless.
    if steps and wall and not performance.get("isolated") and not paced:
        rest = wall - sum(steps.values())
        rows.append(("time in the master", f"{rest:.2f} s ({100.0 * rest / wall:.0f} %): exchange, recording"))
    if paced:
        late = f"{paced['missed']} of {paced['steps']} deadlines missed, by {1e3 * paced['lateness']['maximum']:.3g} ms"
        rows.append((f"real time x {paced['factor']:g}", f"{late} at most"))
    if "peak_memory" in performance:
        rows.append(("peak memory", f"{performance['peak_memory']:.0f} MB"))
    return rows


def _identity(component: Mapping[str, Any]) -> tuple[str, str]:
    return f"sha256 {component.get('sha256', '-')}", f"GUID {component.get('guid', '-')}"


def provenance_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return when, and with which FMUs and versions, the run was computed."""
    rows = [("scenario", str(summary.get("scenario", ""))), ("date", str(summary.get("date", "")))]
    rows += [
        (f"FMU of {c['name']}", ", ".join([c.get("fmu", "-"), c.get("tool", ""), *_identity(c)]))
        for c in summary.get("components", [])
    ]
    rows += [
        (f"definition of {c['name']}", c["definition"]) for c in summary.get("components", []) if c.get("definition")
    ]
    rows += [(f"version of {k}", str(v)) for k, v in summary.get("versions", {}).items()]
    return rows
