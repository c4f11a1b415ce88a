"""The form of a line, found once: kept in the user's cache by the hash of all that it follows from.

Form finding takes half the time in which a line is made ready. What is kept are its numbers as they are, so that a line
is the same to the bit with and without them; matrices are assembled again from these.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from types import ModuleType
from typing import Final

import numpy as np
import scipy

from models.arrays import FloatArray, Snapshot
from models.catenary.definition import line_definition, section_definition, track_definition
from models.catenary.definition.condition_definition import Irregularity
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.dropper_set import dropper_set
from models.catenary.shape.form_finding import StaticState, find_form
from models.catenary.shape.line_mesh import CatenaryMesh
from models.catenary.shape.line_shape import line_shape
from models.numerics.user_cache import keep_arrays, kept_arrays

#: What of a static state is kept; its shape, its droppers and their matrices follow.
_KEPT: Final = ("displacement", "dropper_force", "unstrained_length", "arm_force", "elastic_force")
#: Modules of the definition whose rules a form follows.
_DEFINING: Final = (line_definition, section_definition, track_definition)
#: What libraries of linear algebra choose their code by, and with it how they round.
_CHOICES: Final = ("OPENBLAS_CORETYPE", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def kept_form(definition: CatenaryDefinition, mesh: CatenaryMesh) -> StaticState:
    """Return what `find_form` does, from the user's cache if it was found before.

    Raises
    ------
    EquilibriumError
        As `find_form`.
    """
    key = _key(definition, mesh)
    numbers = _numbers(kept_arrays(key), mesh) if key else None
    if numbers is not None:
        return _state(definition, mesh, numbers)
    state = find_form(definition, mesh)
    if key:
        found = {name: getattr(state, name) for name in _KEPT}
        keep_arrays(key, {**found, "points": state.shape.points, "residual": np.array(state.residual)})
    return state


def _state(definition: CatenaryDefinition, mesh: CatenaryMesh, kept: Mapping[str, FloatArray]) -> StaticState:
    points = kept["points"]
    # Arms that pushed stand on the other side since.
    ends = mesh.points.copy()
    ends[mesh.arms[:, 0], 1] = points[mesh.arms[:, 0], 1]
    mesh = replace(mesh, points=ends)
    positions = points + kept["displacement"].reshape(-1, NODE_DOFS)[:, :3]
    return StaticState(
        shape=line_shape(definition, mesh, points),
        droppers=dropper_set(definition, mesh, positions),
        residual=float(kept["residual"]),
        **{name: kept[name] for name in _KEPT},
    )


def _numbers(kept: Snapshot | None, mesh: CatenaryMesh) -> dict[str, FloatArray] | None:
    """Return the numbers of a line with this mesh, None if these are not such, as far as their shapes tell."""
    if kept is None:
        return None
    droppers, arms = (len(mesh.droppers),), (len(mesh.arms),)
    shapes: dict[str, tuple[int, ...]] = {"points": mesh.points.shape, "residual": ()}
    shapes |= dict(zip(_KEPT, ((mesh.fixed.size,), droppers, droppers, arms, droppers), strict=True))
    numbers = {name: np.asarray(array, dtype=np.float64) for name, array in kept.items()}
    return numbers if {name: array.shape for name, array in numbers.items()} == shapes else None


def _source(module: ModuleType) -> Path:
    return Path(str(module.__file__))


def _code() -> bytes:
    """Return a hash of the code that finds a form, nothing where it cannot be read."""
    whole = hashlib.sha256()
    try:
        for path in (*sorted(Path(__file__).parent.glob("*.py")), *map(_source, _DEFINING)):
            whole.update(path.read_bytes())
    except OSError:
        return b""
    return whole.digest()


#: Read now: an FMU's folder may be gone when a second instance asks for the form.
_CODE: Final = _code()


def _key(definition: CatenaryDefinition, mesh: CatenaryMesh) -> str:
    """Return a hash of definition, mesh, code, libraries and processor; empty where the code cannot be read."""
    if not _CODE:
        return ""
    whole = hashlib.sha256(_CODE)
    whole.update("\0".join((sys.version, np.__version__, scipy.__version__, *_processor())).encode())
    # Errors and faults come after the form: all samples of them share one.
    whole.update(repr(replace(definition, irregularity=Irregularity(), fault=())).encode())
    for field in fields(mesh):
        value = getattr(mesh, field.name)
        for array in (value,) if isinstance(value, np.ndarray) else (chain.nodes for chain in value):
            whole.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return whole.hexdigest()


def _processor() -> tuple[str, ...]:
    """Return what the processor can do, and what the user has chosen of it: sums are rounded accordingly."""
    try:
        features = str(np.show_config(mode="dicts").get("SIMD Extensions"))
    except (AttributeError, TypeError):
        features = ""
    return platform.machine(), features, *(f"{name}={os.environ.get(name)}" for name in _CHOICES)
