"""Reading the modelDescription.xml of an FMU."""

from __future__ import annotations

import hashlib
import math
import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import fmpy

from master.errors import one_line
from master.fmu.fmu_provision import definition_of
from master.ssp.archive import read_member
from master.ssp.ssp_units import BASE_UNITS, Unit
from master.ssp.ssp_xml import XmlError, is_one_line, safe_root
from master.system.components import Fmu, Variable

_DESCRIPTION: Final = "modelDescription.xml"
#: What FMPy raises without a message where something is missing.
_UNWORDED: Final = (TypeError, AttributeError, LookupError, AssertionError)
#: FMI 2.0 wants a C identifier; a path would lead out of the FMU.
_IDENTIFIER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def read_fmu(path: Path) -> Fmu:
    """Read an FMI 2.0 co-simulation FMU's description.

    Raises
    ------
    ValueError
        With the reason, if it is not one.
    """
    try:
        root = safe_root(read_member(path, _DESCRIPTION))
        version = root.get("fmiVersion") or "(no version stated)"
        if version == "2.0":  # others describe their variables otherwise
            _check_variables(root)
    except XmlError as error:
        raise ValueError(f"is not a readable FMU ({_DESCRIPTION}:{error.line}: {error})") from error
    except ValueError as error:
        raise ValueError(f"is not a readable FMU ({error})") from error
    if version != "2.0":
        text = "an FMI 2.0 co-simulation FMU is needed: let the tool that made it export one"
        raise ValueError(f"is an FMU of FMI {one_line(version)}; {text}")
    try:
        description = fmpy.read_model_description(str(path), validate=False)
    except Exception as error:  # FMPy raises bare exceptions of many kinds
        why = "it lacks what FMI 2.0 demands" if isinstance(error, _UNWORDED) else error
        raise ValueError(f"is not a readable FMU ({_DESCRIPTION}: {why})") from error
    if description.coSimulation is None:
        raise ValueError("has no co-simulation interface")
    identifier = description.coSimulation.modelIdentifier
    if not _IDENTIFIER.fullmatch(identifier or ""):
        raise ValueError(f"has the modelIdentifier '{identifier}', which cannot be the name of a library")
    return Fmu(
        path=path,
        guid=description.guid or "",
        identifier=identifier,
        variables=_variables(description.modelVariables, _differences(root)),
        can_restore=bool(description.coSimulation.canGetAndSetFMUstate),
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        tool=description.generationTool or "",
        can_serialise=bool(description.coSimulation.canSerializeFMUstate),
        units=_units(description.unitDefinitions, f"{path.name} ({_DESCRIPTION})"),
        tolerance=_tolerance(description.defaultExperiment),
        is_single=bool(description.coSimulation.canBeInstantiatedOnlyOncePerProcess),
        definition=definition_of(path),
        description=description.description or "",
    )


def lacking_binary(path: Path, identifier: str) -> str:
    """Return what is wrong with an FMU that has no library for this machine, empty if it has one."""
    with zipfile.ZipFile(path) as file:
        names = file.namelist()
    if f"binaries/{fmpy.platform}/{identifier}{fmpy.sharedLibraryExtension}" in names:
        return ""
    folders = sorted({name.split("/")[1] for name in names if name.startswith("binaries/") and name.count("/") > 1})
    held = f"binaries for {' and '.join(folders)} only" if folders else "no binaries"
    return f"holds {held}; this machine needs one for {fmpy.platform}"


def _tolerance(experiment: Any | None) -> float | None:
    """Return the relative tolerance of the default experiment, None if it has no meaningful one."""
    try:
        value = float(experiment.tolerance) if experiment is not None and experiment.tolerance is not None else 0.0
    except ValueError:
        return None
    return value if 0.0 < value < math.inf else None


def _units(defined: Sequence[Any], file: str) -> dict[str, Unit]:
    """Return the units that an FMU defines in SI units; of others it gives no more than the name."""
    found = {}
    for unit in defined or ():
        base = unit.baseUnit
        if base is None:
            continue
        try:
            dimension = tuple(int(getattr(base, name) or 0) for name in BASE_UNITS)
            factor, offset = (float(default if v is None else v) for v, default in ((base.factor, 1), (base.offset, 0)))
        except ValueError:
            continue
        if factor and math.isfinite(factor) and math.isfinite(offset):
            found[unit.name] = Unit(unit.name, dimension, factor, offset, file)  # type: ignore[arg-type]
    return found


def _check_variables(root: Any) -> None:
    for node in root.iter("ScalarVariable"):
        reference = node.get("valueReference", "")
        if not (node.get("name") and reference.isascii() and reference.isdigit() and int(reference[:11]) < 2**32):
            text = f"a variable name='{node.get('name', '')}' with valueReference='{reference}' cannot be addressed"
            raise XmlError(int(node.sourceline or 0), text)
        if not is_one_line(node.get("name")):  # FMI wants names on one line, and so do the tables of a run
            raise XmlError(int(node.sourceline or 0), f"the variable name {node.get('name')!r} is not one line of text")


def _variables(declared: Sequence[Any], differences: Mapping[str, bool]) -> dict[str, Variable]:
    found: dict[str, Variable] = {}
    for v in declared:
        if v.name in found:
            raise ValueError(f"declares the variable '{v.name}' twice")
        found[v.name] = _variable(v, differences.get(v.name))
    return found


def _variable(v: Any, is_difference: bool | None) -> Variable:
    unit = v.unit or (v.declaredType.unit if v.declaredType is not None else None) or ""
    of_type = bool(getattr(v.declaredType, "relativeQuantity", False))
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=v.type,
        causality=v.causality or "local",
        variability=v.variability or "continuous",
        unit=unit,
        start=v.start,
        minimum=_limit(v, "min"),
        maximum=_limit(v, "max"),
        description=v.description or "",
        initial=v.initial or "",  # FMPy knows the defaults of the standard
        items=_items(v),
        is_difference=of_type if is_difference is None else is_difference,
    )


def _differences(root: Any) -> dict[str, bool]:
    """Return which variables state whether they are relative quantities; FMPy reads only their types."""
    reals = ((v.get("name"), v.find("Real")) for v in root.iter("ScalarVariable"))
    said = ((name, real.get("relativeQuantity")) for name, real in reals if real is not None)
    return {name: text in ("true", "1") for name, text in said if text is not None}


def _items(v: Any) -> tuple[tuple[str, int], ...]:
    items = getattr(v.declaredType, "items", None) or ()
    try:
        return tuple((item.name, int(item.value)) for item in items) if v.type == "Enumeration" else ()
    except ValueError:
        raise ValueError(f"declares an item of the enumeration '{v.declaredType.name}' that is no number") from None


def _limit(v: Any, name: str) -> float | None:
    text = getattr(v, name, None) or getattr(v.declaredType, name, None)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise ValueError(f"declares {name}='{text}' for the variable '{v.name}', which is not a number")
    return value
