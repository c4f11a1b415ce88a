"""What room a line leaves under overbridges: from the highest wire to the underside, at rest and with wires lifted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray, IntArray
from models.catenary.definition.overbridge_definition import Overbridge
from models.catenary.line_model import CatenaryModel
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.line_mesh import CatenaryMesh
from models.catenary.statics.elasticity import rise_of_nodes

#: Places under a bridge at which a force lifts the line, one after the other.
_PLACES: Final = 7


@dataclass(frozen=True)
class OverbridgeRoom:
    """Overbridges over a line, arrays of shape (n,) [m]; NaN where the line has no wire of the kind under one.

    Attributes
    ----------
    highest : ndarray
        The highest point of any wire under the bridge, above the rail plane.
    clearance : ndarray
        From there to the underside.
    encumbrance : ndarray
        Least height of the messenger wire above the contact wire of its section.
    lift : ndarray
        How far the messenger wire is lifted at most, as given or by a force on the contact wire at rest.
    """

    highest: FloatArray
    clearance: FloatArray
    encumbrance: FloatArray
    lift: FloatArray

    @property
    def clearance_lifted(self) -> FloatArray:
        """Return the distances with the wires lifted [m]."""
        return self.clearance - self.lift


def overbridge_room(model: CatenaryModel, force: float) -> OverbridgeRoom:
    """Return what room a line at rest leaves under its bridges; a force on the contact wire lifts it there [N]."""
    over = model.definition.overbridge
    heights = highest_wires(model.static, over)
    return OverbridgeRoom(
        highest=heights,
        clearance=np.array([s.underside for s in over]) - heights,
        encumbrance=np.array([_encumbrance(model.static, s) for s in over]),
        lift=np.array([_lift(model, s, force) if s.lift is None else s.lift for s in over]),
    )


def highest_wires(static: StaticState, overbridges: Sequence[Overbridge]) -> FloatArray:
    """Return the height of the highest wire under every bridge, shape (n,) [m]; NaN where there is none."""
    chains = static.shape.mesh.chains
    return np.array([
        max((h for c in chains for h in _heights(static, c.nodes, s)), default=np.nan) for s in overbridges
    ])  # fmt: skip


def _under(x: FloatArray, overbridge: Overbridge) -> FloatArray:
    """Return the places of a wire under a bridge: its nodes, and where the bridge begins and ends."""
    start, end = max(overbridge.start, x[0]), min(overbridge.end, x[-1])
    return np.unique([start, *x[(x > start) & (x < end)], end]) if start <= end else np.zeros(0)


def _heights(static: StaticState, nodes: IntArray, overbridge: Overbridge) -> FloatArray:
    x, _, z = static.positions[nodes].T
    return np.interp(_under(x, overbridge), x, z)


def _encumbrance(static: StaticState, overbridge: Overbridge) -> float:
    """Return the least height of a messenger wire above the contact wire of its section under a bridge [m]."""
    mesh, found = static.shape.mesh, [np.inf]
    for section in {c.section for c in mesh.chains}:
        upper, lower = (static.positions[_nodes(mesh, name, section)].T for name in ("messenger_wire", "contact_wire"))
        x = _under(lower[0], overbridge)
        found += (np.interp(x, upper[0], upper[2]) - np.interp(x, lower[0], lower[2])).tolist()
    return float(min(found)) if len(found) > 1 else float("nan")


def _lift(model: CatenaryModel, overbridge: Overbridge, force: float) -> float:
    """Return how far a force on the contact wire under a bridge lifts the messenger wire there, at most [m]."""
    static, mesh, found = model.static, model.mesh, [-np.inf]
    for section in range(len(model.wires)):
        upper, lower = (_nodes(mesh, name, section) for name in ("messenger_wire", "contact_wire"))
        x = _under(static.positions[lower, 0], overbridge)
        if not x.size:
            continue
        rises = rise_of_nodes(model, np.linspace(x[0], x[-1], _PLACES), force, section)[:, upper]
        along = static.positions[upper, 0]
        under = _under(along, overbridge)
        found += [float(np.interp(under, along, rise).max()) for rise in rises]
    return max(found) if len(found) > 1 else float("nan")


def _nodes(mesh: CatenaryMesh, component: str, section: int) -> IntArray:
    return next(c.nodes for c in mesh.chains if c.component == component and c.section == section)
