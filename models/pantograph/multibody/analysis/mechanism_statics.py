"""Static equilibrium: which lifting moment (or force) holds the strip where, against which contact force."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.analysis.linearisation import balancing_multipliers, stiffness_under
from models.pantograph.multibody.mechanism import Inputs, Mechanism, MechanismError, Placed
from models.pantograph.multibody.mechanism_assembly import (
    assemble,
    check_strip,
    coordinate,
    free_motions,
    null_space,
    project,
)

#: Of Newton's method, after which there is held to be no equilibrium.
ITERATIONS: Final = 60
#: Largest change of height from one solution to the next on the way to a distant one [m].
_STAGE: Final = 0.05
#: Degrees of freedom of a pantograph that is one: raise, heave and roll of the head.
USUAL_FREEDOM: Final = 3
#: How far from its assembled place the strip's body may come to rest [m, rad].
_NEAR: Final = 0.1
_UPRIGHT: Final = 0.2
#: Residual load at which an equilibrium is accepted, relative to the weights.
_BALANCED: Final = 1e-11


#: A condition: state -> value that must vanish.
Condition = Callable[[FloatArray], float]


@dataclass(frozen=True)
class Equilibrium:
    """A mechanism at rest.

    Attributes
    ----------
    y : ndarray, shape (13 n,)
        State.
    inputs : Inputs
        The lifting value, contact force and point that hold it.
    strip_height : float
        Of the strip's middle above the base's origin [m].
    """

    y: FloatArray
    inputs: Inputs
    strip_height: float

    @property
    def lift(self) -> float:
        """Lifting force or moment [N or N.m]."""
        return self.inputs.lift


def equilibrium(
    mechanism: Mechanism,
    strip_height: float | None = None,
    *,
    contact_force: float = 0.0,
    lateral: float = 0.0,
    start: FloatArray | None = None,
) -> Equilibrium:
    """Find the lifting value that balances the mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    strip_height : float, optional
        Height of the strip's middle above the base's origin [m]; without it the coordinate that the assembly keeps
        stays as written: the working configuration.
    contact_force : float
        Downward force on the strip [N].
    lateral : float
        y of its point of application [m].
    start : ndarray, optional
        State to start from; the assembled one by default.

    Raises
    ------
    MechanismError
        If there is none, or the height is out of reach.
    """
    y = assemble(mechanism) if start is None else start

    def inputs(lift: float) -> Inputs:
        return Inputs(lift=lift, force=contact_force, lateral=lateral)

    if strip_height is None:
        y, lift = _solve(mechanism, y, inputs, 0.0, _kept(mechanism, y))
    else:
        y, lift = _approach(mechanism, y, inputs, 0.0, strip_height)
    return Equilibrium(y, inputs(lift), mechanism.strip_height(y))


def equilibrium_where(
    mechanism: Mechanism, condition: Condition, start: FloatArray, *, contact_force: float = 0.0, lift: float = 0.0,
    iterations: int = ITERATIONS,
) -> Equilibrium:  # fmt: skip
    """Find the lifting value that balances the mechanism where a condition on its configuration holds.

    Parameters
    ----------
    condition : callable
        Takes a state, returns what must vanish there.
    start : ndarray, shape (13 n,)
        A state nearby.
    lift : float
        The lifting value to begin with [N or N.m].
    iterations : int
        After how many there is held to be none.

    Raises
    ------
    MechanismError
        If there is none.
    """

    def inputs(value: float) -> Inputs:
        return Inputs(lift=value, force=contact_force)

    y, lift = _solve(mechanism, start, inputs, lift, condition, iterations)
    return Equilibrium(y, inputs(lift), mechanism.strip_height(y))


def contact_force_at(
    mechanism: Mechanism, strip_height: float, lift: float, *, start: FloatArray | None = None,
    uplift: float = 0.0, against: float = 0.0,
) -> Equilibrium:  # fmt: skip
    """Find the contact force that holds the strip's middle at a height [m] against a given lifting value.

    Parameters
    ----------
    uplift : float
        Force that the lifting element brings to the strip besides [N].
    against : float
        Speed against the air [m/s].
    """
    y = assemble(mechanism) if start is None else start

    def inputs(force: float) -> Inputs:
        return Inputs(lift=lift, force=force, uplift=uplift, against=against)

    y, force = _approach(mechanism, y, inputs, 1e-6, strip_height)
    return Equilibrium(y, inputs(force), mechanism.strip_height(y))


def lift_over_height(mechanism: Mechanism, heights: FloatArray, contact_force: float = 0.0) -> tuple[Equilibrium, ...]:
    """Return the equilibria at several strip heights above the base's origin, each found from the one before."""
    y: FloatArray | None = None
    found = []
    for height in heights:
        found.append(equilibrium(mechanism, float(height), contact_force=contact_force, start=y))
        y = found[-1].y
    return tuple(found)


def weight_carrying_lengths(mechanism: Mechanism, y: FloatArray) -> FloatArray:
    """Return the free lengths with which the springs set to carry the weights do so in a configuration.

    The lifting element and the contact do nothing then.

    Returns
    -------
    ndarray, shape (springs,)
        In the order of the definition [m].

    Raises
    ------
    MechanismError
        If these springs cannot balance the weights.
    """
    lines = mechanism.forces.lines
    kinematics = mechanism.kinematics(y)
    vectors = mechanism.pool.evaluate(kinematics)
    length, _, divisor = lines.lengths(vectors)
    basis = null_space(mechanism, y)
    W = mechanism.roots(kinematics.frames)

    def reduce(loads: FloatArray) -> FloatArray:
        reduced: FloatArray = basis.T @ (loads[:, None, :] @ W).ravel()
        return reduced

    per_newton = [reduce(lines.spread(np.eye(lines.count)[k] / divisor, vectors)) for k in lines.carries]
    for k in lines.carries:
        lines.free_length[k] = length[k]
    missing = reduce(mechanism.loads(y, kinematics, Inputs()))
    matrix = np.array(per_newton).T
    tension = np.linalg.lstsq(matrix, -missing, rcond=None)[0]
    if np.abs(matrix @ tension + missing).max() > 1e-8 * (1.0 + np.abs(missing).max()):
        names = ", ".join(lines.names[k] for k in lines.carries)
        raise MechanismError(f"{mechanism.definition.name}: the springs {names} cannot carry the weights alone")
    lengths: FloatArray = length[lines.carries] - tension / lines.stiffness[lines.carries]
    return lengths


def settle_springs(mechanism: Mechanism) -> FloatArray:
    """Give the springs that carry the weights their free lengths; return the working configuration at rest.

    Raises
    ------
    MechanismError
        If there is none, or if the strip then is far from where the assembly has it.
    """
    assembled = assemble(mechanism)
    check_strip(mechanism, assembled)
    lines = mechanism.forces.lines
    if len(lines.carries):
        lines.free_length[lines.carries] = weight_carrying_lengths(mechanism, assembled)
    found = equilibrium(mechanism, start=assembled).y
    _check_nearness(mechanism, assembled, found)
    return found


def _check_nearness(mechanism: Mechanism, assembled: FloatArray, found: FloatArray) -> None:
    """Refuse an equilibrium in which the strip hangs elsewhere, although the kept coordinate is where it should be.

    The strip's body alone counts: a link that hangs from one end is a fault, but the strip may stand on the rest.
    """
    k = mechanism.strip_body
    if k < 0:
        return
    was, now = mechanism.split(assembled), mechanism.split(found)
    distance = float(np.linalg.norm(now.r[k] - was.r[k]))
    angle = 2.0 * float(np.arccos(min(1.0, abs(float(now.p[k] @ was.p[k])))))
    if distance <= _NEAR and angle <= _UPRIGHT:
        return
    kept = mechanism.definition.assembly
    raise MechanismError(
        f"{mechanism.definition.name}: with {kept.body}.{kept.coordinate} as written, the equilibrium has the strip's "
        f"body '{mechanism.names[k]}' {distance:.3g} m and {np.degrees(angle):.3g} degrees from where it was put "
        f"together, {mechanism.strip_height(found):.3g} m above the base: {_suspicion(mechanism, assembled)}"
    )


def _suspicion(mechanism: Mechanism, y: FloatArray) -> str:
    """Return what the number of motions that the joints allow says about them."""
    freedom = null_space(mechanism, y).shape[1]
    if freedom <= USUAL_FREEDOM:
        return f"check places, springs and lift ({freedom} degrees of freedom, as a pantograph has)"
    rows = Counter(joint.name for joint in mechanism.joint_of_row)
    listed = ", ".join(f"{name} {count}" for name, count in sorted(rows.items(), key=lambda item: item[1]))
    return (
        f"a joint is missing or too free ({freedom} degrees of freedom, a pantograph has {USUAL_FREEDOM}; "
        f"joints with few constraints first: {listed})"
    )


def _approach(
    mechanism: Mechanism, y: FloatArray, inputs_of: Callable[[float], Inputs], unknown: float, height: float
) -> tuple[FloatArray, float]:
    """Solve for a strip height, going there in stages."""
    now = mechanism.strip_height(y)
    stages = max(1, int(np.ceil(abs(height - now) / _STAGE)))
    for target in np.linspace(now, height, stages + 1)[1:]:
        y, unknown = _solve(mechanism, y, inputs_of, unknown, _height(mechanism, float(target)))
    return y, unknown


def _solve(
    mechanism: Mechanism,
    y: FloatArray,
    inputs_of: Callable[[float], Inputs],
    unknown: float,
    condition: Condition,
    iterations: int = ITERATIONS,
) -> tuple[FloatArray, float]:
    """Solve by Newton's method for the configuration and one unknown input, in the motions that the joints allow.

    The loads are linear in the unknown; each step is limited so that bodies turn and move by little.
    """
    scale = float(np.abs(mechanism.mass).sum() * mechanism.definition.gravity) or 1.0
    for _ in range(iterations):
        placed = mechanism.placed(y)
        basis = free_motions(mechanism, placed.scaled)
        loads = _scaled_loads(mechanism, y, inputs_of(unknown), placed)
        load = basis.T @ loads
        gap = condition(y)
        if np.abs(load).max() <= _BALANCED * scale and abs(gap) <= 1e-12:
            return y, unknown
        by_unknown = basis.T @ _scaled_loads(mechanism, y, inputs_of(unknown + 1.0), placed) - load
        slope = _slope(mechanism, y, basis, condition)
        multipliers = balancing_multipliers(placed.scaled, loads)
        K = stiffness_under(mechanism, y, inputs_of(unknown), basis, multipliers)
        system = np.block([[K, -by_unknown[:, None]], [slope[None, :], np.zeros((1, 1))]])
        step = np.linalg.lstsq(system, np.append(load, -gap), rcond=1e-13)[0]
        shifts, turns = mechanism.unscaled(basis @ step[:-1])
        limit = min(1.0, 0.1 / max(float(np.abs(shifts).max()), float(np.abs(turns).max()), 1e-300))
        y = project(mechanism, mechanism.moved(y, limit * (basis @ step[:-1])))
        unknown += float(limit * step[-1])
    raise MechanismError(
        f"{mechanism.definition.name}: no static equilibrium found; strip at {mechanism.strip_height(y):.4g} m above "
        f"the base, {abs(gap):.3g} m from where it is wanted, residual load {np.abs(load).max():.3g} N: "
        f"{_suspicion(mechanism, y)}"
    )


def _scaled_loads(mechanism: Mechanism, y: FloatArray, inputs: Inputs, placed: Placed) -> FloatArray:
    """Return the applied loads in scaled coordinates, shape (6 n,)."""
    loads = mechanism.loads(y, placed.kinematics, inputs, placed.vectors)
    return (loads[:, None, :] @ placed.roots).ravel()


def _slope(mechanism: Mechanism, y: FloatArray, basis: FloatArray, condition: Condition) -> FloatArray:
    """Return the condition's derivatives along the basis, by central differences."""
    h = 1e-6
    ahead = [condition(mechanism.moved(y, h * column)) for column in basis.T]
    behind = [condition(mechanism.moved(y, -h * column)) for column in basis.T]
    return (np.array(ahead) - np.array(behind)) / (2.0 * h)


def _height(mechanism: Mechanism, height: float) -> Condition:
    return lambda y: mechanism.strip_height(y) - height


def _kept(mechanism: Mechanism, y: FloatArray) -> Condition:
    choice = mechanism.definition.assembly
    if not choice.body:
        raise MechanismError(f"{mechanism.definition.name}: [assembly] names no body whose coordinate is kept")
    kept = coordinate(mechanism, y, choice.body, choice.coordinate)
    return lambda y: coordinate(mechanism, y, choice.body, choice.coordinate) - kept
