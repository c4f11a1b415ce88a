"""A mechanism put together: projection on the constraints, and the messages where it does not fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from models.arrays import FloatArray, IntArray
from models.pantograph.multibody.mechanism import NO_INPUTS, Mechanism, MechanismError

#: Largest violation of an assembled mechanism [m or 1].
CLOSED: Final = 1e-12
_ITERATIONS: Final = 300
#: Weight of the kept coordinate among the gaps.
_KEEP: Final = 1e3
_LARGEST_STEP: Final = 0.2
#: Least component across the track of a strip's direction.
_ACROSS: Final = 0.9


def assemble(mechanism: Mechanism) -> FloatArray:
    """Close all joints, starting from the configuration as written and keeping the chosen coordinate.

    Bodies move as little as they must (metres and radians weigh the same). Bushings are untwisted in what is found: as
    written, bodies stand where the rounding of their tables puts them, which would be a preload that nobody meant.

    Returns
    -------
    ndarray, shape (13 n,)
        State at rest.

    Raises
    ------
    MechanismError
        If a joint as written gapes by more than ``assembly.largest_gap``, if the joints cannot all be closed, or
        if some of them repeat what others already say; names the joint and says by how many mm.
    """
    _check_written_gaps(mechanism)
    y = mechanism.written_state()
    mechanism.place_base(y, NO_INPUTS)
    rows = np.arange(mechanism.constraints.count)
    closed, violation = _close(mechanism, y, rows)
    if violation > CLOSED * 10.0:
        raise MechanismError(_unassemblable(mechanism, y))
    _check_independence(mechanism, closed)
    mechanism.forces.untwist(mechanism.kinematics(closed).frames[:, :3])
    return closed


def joint_gaps(mechanism: Mechanism, y: FloatArray) -> dict[str, tuple[float, float]]:
    """Return by how much every joint is open: distance [m] and misalignment of its axes [rad]."""
    violation = mechanism.constraint_values(mechanism.kinematics(y)).violation
    gaps: dict[str, tuple[float, float]] = {}
    for joint in mechanism.definition.joints:
        mine = np.array([j is joint for j in mechanism.joint_of_row], dtype=bool)
        if mine.any():
            distance = float(np.linalg.norm(violation[mine & mechanism.is_gap]))
            angle = float(np.linalg.norm(violation[mine & ~mechanism.is_gap]))
            gaps[joint.name] = (distance, angle)
    return gaps


def project(mechanism: Mechanism, y: FloatArray, tolerance: float = CLOSED) -> FloatArray:
    """Move a nearly closed mechanism onto its constraints, positions and velocities, by the shortest way.

    Distances are measured by the mass matrix, so that the correction does the least to the motion.

    Raises
    ------
    MechanismError
        If that does not succeed within a few iterations.
    """
    y = y.copy()
    s = mechanism.split(y)
    s.p[:] /= np.linalg.norm(s.p, axis=1, keepdims=True)
    for _ in range(20):
        values, scaled = mechanism.scaled_jacobian(y)
        schur = scaled @ scaled.T
        if np.abs(values.violation).max(initial=0.0) <= tolerance:
            break
        y = mechanism.moved(y, -scaled.T @ np.linalg.solve(schur, values.violation))
    else:
        worst = max(joint_gaps(mechanism, y).items(), key=lambda item: max(item[1]))
        raise MechanismError(f"joint '{worst[0]}' cannot be closed again: open by {_gap_text(*worst[1])}")
    correction = -scaled.T @ np.linalg.solve(schur, values.rate)
    s = mechanism.split(y)
    shifts, turns = mechanism.unscaled(correction)
    s.v[:] += shifts
    s.w[:] += turns
    return y


def check_strip(mechanism: Mechanism, y: FloatArray) -> None:
    """Raise ``MechanismError`` if a collector strip does not lie across the track in a state, shape (13 n,)."""
    if mechanism.strip_body < 0:
        return
    ends = mechanism.strip_ends(y)[:, 0]
    across = ends[0] - ends[1]
    share = abs(float(across[1])) / max(float(np.linalg.norm(across)), 1e-300)
    if share < _ACROSS:
        body = mechanism.names[mechanism.strip_body]
        raise MechanismError(
            f"{mechanism.definition.name}: the strip lies along the track, {np.degrees(np.arccos(share)):.0f} degrees "
            f"from across it: check `euler` of body '{body}'"
        )


def null_space(mechanism: Mechanism, y: FloatArray) -> FloatArray:
    """Return an orthonormal basis, shape (6 n, d), of the motions that the joints allow, in scaled coordinates.

    Its columns are velocities with M-norm 1; bodies of prescribed motion stand still.
    """
    return free_motions(mechanism, mechanism.scaled_jacobian(y)[1])


def free_motions(mechanism: Mechanism, scaled: FloatArray) -> FloatArray:
    """Return the same for the constraints' Jacobian in scaled coordinates, shape (m, 6 n)."""
    free = scaled[:, 6 * mechanism.driven :]
    _, singular, right = np.linalg.svd(free, full_matrices=True)
    rank = int((singular > 1e-9 * singular.max(initial=0.0)).sum())
    basis = np.zeros((scaled.shape[1], right.shape[0] - rank))
    basis[6 * mechanism.driven :] = right[rank:].T
    return basis


def constraint_rank(mechanism: Mechanism, y: FloatArray) -> int:
    """Return the number of independent constraints of the joints, the base being as free as any body."""
    jacobian = mechanism.constraint_values(mechanism.kinematics(y)).jacobian
    return int(np.linalg.matrix_rank(jacobian.reshape(mechanism.constraints.count, -1), tol=1e-9))


def _close(
    mechanism: Mechanism, y: FloatArray, rows: IntArray, weights: FloatArray | None = None
) -> tuple[FloatArray, float]:
    """Close some rows by Levenberg-Marquardt steps; return the state and the largest weighted violation left.

    With nothing in the way these are Newton steps of least length; where the rows cannot all be closed they lead to
    the smallest gap in the sense of the weights.
    """
    scale = np.ones(len(rows)) if weights is None else weights
    goal = _kept_value(mechanism, y)
    damping = 0.0
    residual, system = _linear_system(mechanism, y, rows, scale, goal)
    for _ in range(_ITERATIONS):
        if np.abs(residual).max(initial=0.0) <= CLOSED:
            break
        trial = _displaced(mechanism, y, _least_step(system, residual, damping))
        new_residual, new_system = _linear_system(mechanism, trial, rows, scale, goal)
        if new_residual @ new_residual < residual @ residual:
            y, residual, system = trial, new_residual, new_system
            damping = damping / 5.0 if damping > 1e-9 else 0.0
        else:
            damping = max(1e-6, 4.0 * damping)
            if damping > 1e12:
                break
    return y, float(np.abs(residual[: len(rows)]).max(initial=0.0))


def _linear_system(
    mechanism: Mechanism, y: FloatArray, rows: IntArray, scale: FloatArray, goal: float
) -> tuple[FloatArray, FloatArray]:
    """Return weighted violations of the rows and of the kept coordinate, and their derivatives, (r,) and (r, 6 n)."""
    values = mechanism.constraint_values(mechanism.kinematics(y))
    jacobian = values.jacobian.reshape(mechanism.constraints.count, 6 * mechanism.count)[rows]
    kept = _kept_row(mechanism, y)
    residual = np.append(scale * values.violation[rows], _KEEP * (_kept_value(mechanism, y) - goal))
    system = np.concatenate([scale[:, None] * jacobian, _KEEP * kept[None, :]])
    system[:, : 6 * mechanism.driven] = 0.0
    return residual, system


def _least_step(system: FloatArray, residual: FloatArray, damping: float) -> FloatArray:
    """Return the step that reduces the residual, not longer than bodies should move at once."""
    if damping > 0.0:
        system = np.concatenate([system, np.sqrt(damping) * np.eye(system.shape[1])])
        residual = np.concatenate([residual, np.zeros(system.shape[1])])
    full = -np.linalg.lstsq(system, residual, rcond=1e-10)[0].view(np.float64)
    step: FloatArray = full * min(1.0, _LARGEST_STEP / max(float(np.abs(full).max(initial=0.0)), 1e-300))
    return step


def _kept_value(mechanism: Mechanism, y: FloatArray) -> float:
    """Return the coordinate that the assembly keeps, 0 if there is none."""
    choice = mechanism.definition.assembly
    return coordinate(mechanism, y, choice.body, choice.coordinate) if choice.body else 0.0


def coordinate(mechanism: Mechanism, y: FloatArray, body: str, name: str) -> float:
    """Return a body's x, y, z [m], e1, e2 or e3 [1]."""
    s, k = mechanism.split(y), mechanism.numbers[body]
    return float(s.r[k, "xyz".index(name)] if name in "xyz" else s.p[k, int(name[1])])


def _displaced(mechanism: Mechanism, y: FloatArray, step: FloatArray) -> FloatArray:
    """Move by displacements and global rotations, shape (6 n,)."""
    by_body = step.reshape(mechanism.count, 6)
    A = mechanism.kinematics(y).frames[:, :3]
    return mechanism.shifted(y, by_body[:, :3], (by_body[:, None, 3:] @ A)[:, 0, :])


def _kept_row(mechanism: Mechanism, y: FloatArray) -> FloatArray:
    """Return the derivative of the kept coordinate by displacements and global rotations, shape (6 n,)."""
    row = np.zeros((mechanism.count, 6))
    choice = mechanism.definition.assembly
    if choice.body:
        k = mechanism.numbers[choice.body]
        name = choice.coordinate
        if name in "xyz":
            row[k, "xyz".index(name)] = 1.0
        else:
            row[k, 3:] = _euler_derivative(mechanism.split(y).p[k], int(name[1]))
    return row.ravel()


def _euler_derivative(p: FloatArray, number: int) -> FloatArray:
    """Return the derivative of e1, e2 or e3 by a global rotation, shape (3,): half of e0 1 - e~."""
    e0, (e1, e2, e3) = p[0], p[1:]
    rows = np.array([[e0, e3, -e2], [-e3, e0, e1], [e2, -e1, e0]])
    derivative: FloatArray = 0.5 * rows[number - 1]
    return derivative


def _check_written_gaps(mechanism: Mechanism) -> None:
    limit = mechanism.definition.assembly.largest_gap
    gaps = joint_gaps(mechanism, mechanism.written_state())
    wide = {name: gap for name, gap in gaps.items() if max(gap) > limit}
    if wide:
        listed = "\n".join(f"  joint '{name}' gapes by {_gap_text(*gap)}" for name, gap in _sorted(wide))
        raise MechanismError(
            f"{mechanism.definition.name}: as written, bodies and joint points do not fit within "
            f"{1e3 * limit:g} mm (assembly.largest_gap):\n{listed}"
        )


def _unassemblable(mechanism: Mechanism, y: FloatArray) -> str:
    """Close joint after joint; the first that cannot be closed with all before it closed is to blame."""
    order = _joint_rows(mechanism)
    rows: IntArray = np.zeros(0, dtype=np.int64)
    for name, mine in order:
        before = len(rows)
        rows = np.concatenate([rows, mine])
        weights = np.concatenate([np.full(before, 100.0), np.ones(len(mine))])
        closed, violation = _close(mechanism, y, rows, weights)
        if violation > 10.0 * CLOSED:
            distance, angle = joint_gaps(mechanism, closed)[name]
            return (
                f"{mechanism.definition.name} cannot be assembled: with the joints before it closed, "
                f"joint '{name}' stays open by {_gap_text(distance, angle)}"
            )
        y = closed
    return f"{mechanism.definition.name} cannot be assembled with {mechanism.definition.assembly} kept"


def _check_independence(mechanism: Mechanism, y: FloatArray) -> None:
    """Blame the joints that repeat earlier ones."""
    values = mechanism.constraint_values(mechanism.kinematics(y))
    jacobian = values.jacobian.reshape(mechanism.constraints.count, -1)[:, 6 * mechanism.driven :]
    if len(jacobian) == 0 or np.linalg.matrix_rank(jacobian, tol=1e-9) == len(jacobian):
        return
    lines, rows, rank = [], jacobian[:0], 0
    written = joint_gaps(mechanism, mechanism.written_state())
    for name, mine in _joint_rows(mechanism):
        rows = np.concatenate([rows, jacobian[mine]])
        new = int(np.linalg.matrix_rank(rows, tol=1e-9))
        if new - rank < len(mine):
            lines.append(
                f"  joint '{name}': {len(mine) - (new - rank)} of its {len(mine)} constraints repeat those of "
                f"the joints before it; as written it gapes by {_gap_text(*written[name])}"
            )
        rank = new
    raise MechanismError(
        f"{mechanism.definition.name} is over-constrained: {len(jacobian)} constraints, {rank} of them independent; "
        "use a joint with more freedom (a spherical one for a hinge, say):\n" + "\n".join(lines)
    )


def _joint_rows(mechanism: Mechanism) -> list[tuple[str, IntArray]]:
    names = [j.name for j in mechanism.joint_of_row]
    return [(name, np.flatnonzero(np.array(names) == name)) for name in dict.fromkeys(names)]


def _sorted(gaps: dict[str, tuple[float, float]]) -> Sequence[tuple[str, tuple[float, float]]]:
    return sorted(gaps.items(), key=lambda item: -max(item[1]))


def _gap_text(distance: float, angle: float) -> str:
    parts = []
    if distance > 0.0 or angle == 0.0:
        parts.append(f"{1e3 * distance:.3g} mm")
    if angle > 0.0:
        parts.append(f"{np.degrees(angle):.3g} degrees")
    return " and ".join(parts)
