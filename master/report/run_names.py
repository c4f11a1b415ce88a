"""What the line, the pantographs and the scenario of a run are called: as their FMUs and the SSD say."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from master.system.contacts import Contact


def model_names(summary: Mapping[str, Any]) -> dict[str, str]:
    """Return what the FMU of every component says that it is; of one that says nothing, or an older run, nothing.

    Examples
    --------
    >>> model_names({"components": [{"name": "catenary", "description": "LN2, simple catenary"}, {"name": "driver"}]})
    {'catenary': 'LN2, simple catenary'}
    """
    return {c["name"]: c["description"] for c in summary.get("components", []) if c.get("description")}


def short_names(summary: Mapping[str, Any]) -> dict[str, str]:
    """Return a short name of every component: of its model, up to the first comma, and its own where two have one.

    Examples
    --------
    >>> cx = {"description": "Faiveley CX, three-stage lumped mass"}
    >>> short_names({"components": [{"name": "pantograph", **cx}]})
    {'pantograph': 'Faiveley CX'}
    >>> short_names({"components": [{"name": "front", **cx}, {"name": "rear", **cx}]})
    {'front': 'Faiveley CX (front)', 'rear': 'Faiveley CX (rear)'}
    >>> short_names({"components": [{"name": "pantograph"}]})
    {'pantograph': 'pantograph'}
    """
    models = model_names(summary)
    components = dict.fromkeys([*(c["name"] for c in summary.get("components", [])), *_meeting(summary)])
    short = {name: models.get(name, name).partition(",")[0] for name in components}
    count = Counter(short.values())
    return {name: text if count[text] == 1 else f"{text} ({name})" for name, text in short.items()}


def coupled_models(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what meets in a run: component and what it is, lines first."""
    models = model_names(summary)
    return [(name, models[name]) for name in dict.fromkeys(_meeting(summary)) if name in models]


def _meeting(summary: Mapping[str, Any]) -> list[str]:
    contacts = [Contact.from_data(c) for c in summary.get("contacts", [])]
    return [*(c.catenary for c in contacts), *(c.pantograph for c in contacts)]
