"""Reading the modelDescription.xml of an FMU."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import fmpy

from master.system import Fmu, Variable


def read_fmu(path: Path) -> Fmu:
    """Read an FMI 2.0 co-simulation FMU's description.

    Raises
    ------
    ValueError
        With the reason, if it is not one.
    """
    try:
        description = fmpy.read_model_description(str(path), validate=False)
    except Exception as error:  # FMPy raises bare exceptions of many kinds
        raise ValueError(f"is not a readable FMU ({error})") from error
    if description.fmiVersion != "2.0":
        raise ValueError(f"is an FMI {description.fmiVersion} FMU; FMI 2.0 is needed")
    if description.coSimulation is None:
        raise ValueError("has no co-simulation interface")
    return Fmu(
        path=path,
        guid=description.guid,
        identifier=description.coSimulation.modelIdentifier,
        variables={v.name: _variable(v) for v in description.modelVariables},
        can_restore=bool(description.coSimulation.canGetAndSetFMUstate),
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        tool=description.generationTool or "",
        can_serialise=bool(description.coSimulation.canSerializeFMUstate),
    )


def _variable(v: Any) -> Variable:
    unit = v.unit or (v.declaredType.unit if v.declaredType is not None else None) or ""
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=v.type,
        causality=v.causality or "local",
        variability=v.variability or "continuous",
        unit=unit,
        start=v.start,
        minimum=_number(v.min),
        maximum=_number(v.max),
        description=v.description or "",
    )


def _number(text: Any) -> float | None:
    return None if text is None else float(text)
