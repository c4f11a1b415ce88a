"""Static equilibrium and form finding.

Either the geometry is specified (the height of the contact wire at every dropper, of the auxiliary wire at every
hanger) and the lengths of the droppers follow, or the unstrained length of a dropper is given and the height follows.
The unknowns are displacements and dropper forces. For given reference points this is one linear saddle-point system;
the points are then moved to the solution and the system is solved again, until the deformed mesh is its own reference.

A designed line whose lengths, supports or droppers have changed since is brought to rest in the same way, with its
droppers' lengths given and its registration ends where they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.line_definition import COMPONENTS, GRAVITY, CatenaryDefinition
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.dropper_conditions import DropperConditions, dropper_conditions
from models.catenary.shape.dropper_set import DropperSet, dropper_lengths, dropper_set, turned_over
from models.catenary.shape.line_matrices import (
    LineAssembly,
    Matrices,
    arm_load,
    axial_stiffness,
    beam_properties,
    pendulum_stiffness,
    steady_arm_tension,
)
from models.catenary.shape.line_mesh import CatenaryMesh
from models.catenary.shape.line_shape import LineShape, shape_about
from models.catenary.shape.steady_arms import arms_without_side, carry_arms, pushing_arms, with_arms_turned
from models.catenary.shape.wire_intervals import attachments

#: Form finding has converged when no reference point moves by more than this [m].
_TOLERANCE = 1e-9
_MAX_ITERATIONS = 30
#: Droppers of given length may go slack only after these iterations, as the first guess is far from equilibrium.
_TAUT_ITERATIONS = 3
#: A point that moves by more than this diverges [m]; the numbers would soon overflow.
_LOST = 1e5
#: First guess of the dropper forces [N]; it affects the path to the solution only.
_FIRST_FORCE = 80.0


class EquilibriumError(ValueError):
    """A line without a static equilibrium of the specified shape; the message names the droppers concerned."""


@dataclass(frozen=True)
class StaticState:
    """Static equilibrium of a line.

    Attributes
    ----------
    shape : LineShape
        The line about its reference points, which lie on the static shape.
    droppers : DropperSet
        Droppers between the static positions.
    displacement : ndarray, shape (6 n,)
        Static displacement from the reference points: axial stretch, rotations of the wires [m, rad].
    dropper_force, unstrained_length : ndarray, shape (n_droppers,)
        Tension [N] and unstrained length [m].
    arm_force : ndarray, shape (n_arms,)
        Tension of the steady arms [N].
    elastic_force : ndarray, shape (n_droppers,)
        Stiffness times stretch [N]: the tension, or a negative value where a given length leaves the dropper slack.
    residual : float
        Largest unbalanced nodal force relative to the weight of the line.
    """

    shape: LineShape
    droppers: DropperSet
    displacement: FloatArray
    dropper_force: FloatArray
    unstrained_length: FloatArray
    arm_force: FloatArray
    elastic_force: FloatArray
    residual: float

    @property
    def positions(self) -> FloatArray:
        """Return the static positions of the nodes, shape (n, 3) [m]."""
        return _displaced(self.shape.points, self.displacement)

    @property
    def is_slack(self) -> BoolArray:
        """Return which droppers hang slack, shape (n_droppers,); a broken one does not hang."""
        return (self.dropper_force <= 0.0) & ~self.shape.mesh.broken

    def pendulum_stiffness(self) -> sp.csc_matrix:
        """Return the pendulum stiffness of droppers and steady arms under their tension, zero where they push."""
        mesh, tension = self.shape.mesh, np.concatenate([self.dropper_force, self.arm_force])
        return pendulum_stiffness(np.vstack([mesh.droppers, mesh.arms]), np.maximum(tension, 0.0), self.positions)


def find_form(definition: CatenaryDefinition, mesh: CatenaryMesh) -> StaticState:
    """Find the dropper lengths for the specified contact-wire profile, or the profile for given lengths.

    A steady arm whose side is not given, and which turns out to push, stands on the other side: each is turned once at
    most, all that push together. On which side it pulls follows from the place of the wires, but for some 25 N that
    bending and inclined droppers add.

    Returns
    -------
    StaticState
        With the mesh of the sides on which the arms pull.

    Raises
    ------
    EquilibriumError
        If a dropper would have to push to give the specified profile, or an arm on a side that is given or on both, if
        the equations are singular, or if the iteration does not converge.
    """
    turnable = arms_without_side(definition)
    while True:
        state = _settled(definition, mesh, mesh.points.copy(), None)
        turning = turnable & pushing_arms(state.shape, state.arm_force)
        if not turning.any():
            _check_arms(state.shape, state.arm_force)
            return state
        turnable &= ~turning
        mesh = with_arms_turned(mesh, turning)


def find_rest(design: StaticState, mesh: CatenaryMesh, points: FloatArray) -> StaticState:
    """Find where a designed line comes to rest after a change, under the tensions that it was designed with.

    Parameters
    ----------
    design : StaticState
        The line as designed: its arms have their lengths from there.
    mesh : CatenaryMesh
        The design's, with the unstrained length of droppers given; some may be broken, seats of supports moved. Where
        no length is given the height of the lower end is, and the force is whatever holds it there, a push as well.
    points : ndarray, shape (n, 3)
        Points of the design, with what holds the line (supports, registration ends) where it is now [m].

    Raises
    ------
    EquilibriumError
        If an arm would have to push, if the equations are singular, or if the iteration does not converge.
    """
    return _settled(design.shape.definition, mesh, points.copy(), design)


def rest_stiffness(static: StaticState) -> sp.csc_matrix:
    """Return how a line at rest resists slow changes, shape (6 n, 6 n): its wires keep their tensions as they move.

    Not symmetric: moves off the wires' axes stretch nothing. In motion, with the ends of the wires held, they do.
    """
    shape, mesh, droppers = static.shape, static.shape.mesh, static.droppers
    moves = np.zeros(mesh.fixed.shape)
    moves[:, :3] = _movable(mesh, carries_arms=False)
    stretch = _of_moves(axial_stiffness(shape.definition, mesh, shape.points, arms=False), moves)
    taut = np.where(static.is_slack, droppers.compression_ratio, 1.0) * droppers.stiffness
    springs = droppers.rows.T @ sp.diags(taut) @ droppers.rows
    return (shape.matrices.K - stretch + springs + static.pendulum_stiffness()).tocsc()


def _settled(
    definition: CatenaryDefinition, mesh: CatenaryMesh, points: FloatArray, design: StaticState | None
) -> StaticState:
    """Move reference points until the line is at rest about them: of the wanted form, or as a design has become."""
    _check_wires(definition, mesh)
    movable = _movable(mesh, carries_arms=design is None)
    unstretched = np.zeros(mesh.fixed.shape)
    unstretched[:, :3] = movable
    force = np.full(len(mesh.droppers), _FIRST_FORCE) if design is None else design.dropper_force
    # What a design keeps as displacements (of the wire at its arms, their stretch) is no move of the reference.
    kept = np.zeros(mesh.fixed.shape) if design is None else unstretched * design.displacement.reshape(-1, NODE_DOFS)
    slack, first = np.zeros(len(mesh.droppers), dtype=bool), points
    assembly = LineAssembly(definition, mesh)
    for iteration in range(_MAX_ITERATIONS):
        shape = _shape(assembly, points, design, damped=False)
        matrices = shape.matrices
        # Moving a reference point redefines the length of the wire, so it does not stretch the wire.
        stretch = _of_moves(assembly.axial_stiffness(points, arms=design is None), unstretched)
        # Likewise the guides act on moves of the reference only, and vanish from the result with them.
        guides = _of_moves(_swing(shape, force, design), unstretched)
        conditions = dropper_conditions(shape, slack)
        load = matrices.load if design is None else matrices.load + (guides - stretch) @ kept.ravel()
        displacement, force = _solve(shape, matrices.K - stretch + guides, conditions, load)
        move = np.where(movable, (displacement.reshape(-1, NODE_DOFS) - kept)[:, :3], 0.0)
        if iteration == 0:
            first = _displaced(points, displacement)
        _check_move(shape, move, first)
        now_slack = _slack(mesh, _displaced(points, displacement))
        if np.abs(move).max() < _TOLERANCE and np.array_equal(slack, now_slack):
            # Solve once more without the guides, to remove what the tolerance of the iteration leaves of them.
            solution = _solve(shape, matrices.K, conditions, matrices.load)
            return _static_state(_shape(assembly, points, design), *solution, slack, design)
        _straighten(mesh, points, move)
        points = points + move
        if design is None:
            carry_arms(mesh, points, move)
        if design is not None or iteration >= _TAUT_ITERATIONS:
            slack = now_slack
    search = "form finding of" if design is None else "the search for the condition of"
    raise EquilibriumError(
        f"{search} line '{definition.name}' has not settled after {_MAX_ITERATIONS} iterations: "
        f"{turned_over(mesh, first) or f'a point still moves by {np.abs(move).max():.2g} m'}"
    )


def _shape(assembly: LineAssembly, points: FloatArray, design: StaticState | None, *, damped: bool = True) -> LineShape:
    """Return the line about reference points; the arms of a design keep their lengths."""
    shape = shape_about(assembly, points, damped=damped)
    if design is None or assembly.definition.steady_arm is None:
        return shape
    load = shape.matrices.load + arm_load(assembly.definition, assembly.mesh, points, design.shape.points)
    return replace(shape, matrices=replace(shape.matrices, load=load))


def _of_moves(matrix: sp.csc_matrix, moves: FloatArray) -> sp.csc_matrix:
    """Return a matrix whose columns are weighted by what moves, shape (n, 6)."""
    result = matrix.copy()
    result.data *= np.repeat(moves.ravel(), np.diff(matrix.indptr))
    return result


def _displaced(points: FloatArray, displacement: FloatArray) -> FloatArray:
    """Return the positions of points after a displacement of all degrees of freedom, shape (n, 3) [m]."""
    return points + displacement.reshape(-1, NODE_DOFS)[:, :3]


def _check_move(shape: LineShape, move: FloatArray, first: FloatArray) -> None:
    """Stop if form finding diverges; the first positions that it found say best why."""
    size = np.abs(move).max(axis=1)
    worst = int(size.argmax())  # the first NaN, if there is one
    if not size[worst] <= _LOST:
        why = turned_over(shape.mesh, first) or (
            f"form finding moves the point at x = {shape.points[worst, 0]:.2f} m by {size[worst]:.2g} m; check "
            "tensions, masses, pre-sag and dropper lengths"
        )
        raise EquilibriumError(f"line '{shape.definition.name}' has no static equilibrium of the wanted shape: {why}")


def _movable(mesh: CatenaryMesh, *, carries_arms: bool) -> np.ndarray:
    """Return which coordinates of the reference form finding may move.

    Not x (the stretch of the wires remains a displacement); not the lateral position of registered nodes whose arms are
    carried along, as their displacement loads the arm; and not that of nodes between two attachments, which follow
    these on a straight line.
    """
    movable = ~mesh.fixed[:, :3]
    movable[:, 0] = False
    if carries_arms:
        movable[mesh.arms[:, 1], 1] = False
    movable[~attachments(mesh), 1] = False
    return movable[mesh.owner]


def _straighten(mesh: CatenaryMesh, points: FloatArray, move: FloatArray) -> None:
    """Move the inner nodes of every interval so that it stays straight in plan between its attachments."""
    held = attachments(mesh)
    for chain in mesh.chains:
        fixed, x = held[chain.nodes], points[chain.nodes, 0]
        move[chain.nodes, 1] = np.interp(x, x[fixed], move[chain.nodes[fixed], 1])


def _slack(mesh: CatenaryMesh, positions: FloatArray) -> np.ndarray:
    """Return which droppers of given length are longer than the distance they span."""
    with np.errstate(invalid="ignore"):
        result: np.ndarray = dropper_lengths(mesh, positions) < mesh.given_length
    return result


def _solve(
    shape: LineShape, K: sp.csc_matrix, conditions: DropperConditions, load: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve [[K, B^T], [R, -D]] [d; N] = [load; right], with R, D and right from the droppers' conditions."""
    mesh = shape.mesh
    free = np.flatnonzero(~mesh.fixed.ravel())
    B = shape.droppers.rows[:, free]
    # The scale makes the rows of the conditions comparable with those of the stiffness.
    scale = 1e4
    D = sp.diags(-(scale**2) * conditions.flexibility)
    system = sp.bmat([[K[free][:, free], scale * B.T], [scale * conditions.rows[:, free], D]], format="csc")
    try:
        solution = splu(system).solve(np.concatenate([load[free], scale * conditions.right]))
    except RuntimeError as error:  # SuperLU's "Factor is exactly singular"
        raise EquilibriumError(
            f"line '{shape.definition.name}' has no static equilibrium of the wanted shape: its equations are "
            "singular, as they are where nothing holds a wire; check tensions, masses and droppers"
        ) from error
    displacement = np.zeros(load.size)
    displacement[free] = solution[: len(free)]
    displacement = displacement.reshape(-1, NODE_DOFS)[mesh.owner].ravel()
    return displacement, solution[len(free) :] * scale


def _swing(shape: LineShape, force: FloatArray, design: StaticState | None) -> sp.csc_matrix:
    """Return the stiffness N/L of the droppers across their axes, as pendulums; of a design's arms as well.

    This guides the iteration where only the droppers hold a wire laterally, and where arms turn.
    """
    bars, tension = shape.mesh.droppers, np.maximum(force, 1.0)
    if design is not None:
        bars = np.vstack([bars, shape.mesh.arms])
        tension = np.concatenate([tension, np.maximum(design.arm_force, 0.0)])
    return pendulum_stiffness(bars, tension, shape.points)


def _static_state(
    shape: LineShape, displacement: FloatArray, force: FloatArray, slack: np.ndarray, design: StaticState | None
) -> StaticState:
    if design is None:
        _check_tension(shape, force)
    uncut = None if design is None else design.shape.points
    arm_force = steady_arm_tension(shape.definition, shape.mesh, shape.points, displacement, uncut)
    if design is not None:
        _check_arms(shape, arm_force)
    droppers = dropper_set(shape.definition, shape.mesh, _displaced(shape.points, displacement))
    stiffness, given = shape.droppers.stiffness, shape.mesh.given_length
    with np.errstate(invalid="ignore"):  # 0 / 0 of a broken dropper, whose length is given
        unstrained = np.where(~np.isnan(given), given, droppers.length - force / stiffness)
    elastic = np.where(slack, stiffness * (droppers.length - unstrained), force)
    force = np.where(slack, droppers.compression_ratio * elastic, force)
    return StaticState(
        shape=shape,
        droppers=droppers,
        displacement=displacement,
        dropper_force=force,
        unstrained_length=unstrained,
        arm_force=arm_force,
        elastic_force=elastic,
        residual=_residual(shape, displacement, force),
    )


def weight(matrices: Matrices) -> float:
    """Return the weight of the whole line [N]."""
    up = np.zeros((matrices.load.size // NODE_DOFS, NODE_DOFS))
    up[:, 2] = 1.0
    return float(GRAVITY * (up.ravel() @ (matrices.M @ up.ravel())))


def _check_wires(definition: CatenaryDefinition, mesh: CatenaryMesh) -> None:
    """Reject wires without tension: beside a stitch wire, or where losses have taken it."""
    tension = beam_properties(definition, mesh).tension
    tension[mesh.component == COMPONENTS.index("steady_arm")] = np.inf
    worst = int(tension.argmin())
    if tension[worst] > 0.0:
        return
    name = COMPONENTS[mesh.component[worst]].replace("_", " ")
    stitched = mesh.beside_stitch[worst]
    why = "under a stitch wire, which takes its own tension from it," if stitched else "after its losses"
    raise EquilibriumError(
        f"line '{definition.name}': at {mesh.points[mesh.beams[worst, 0], 0]:.2f} m the {name} {why} has a tension of "
        f"{tension[worst]:.0f} N: a wire must pull; "
        + (
            "give the stitch wire less (stitch_wire.tension), or let the messenger wire lose less"
            if stitched
            else "let it lose less"
        )
    )


def _check_tension(shape: LineShape, force: FloatArray) -> None:
    slack = np.flatnonzero((force <= 0.0) & np.isnan(shape.mesh.given_length))
    if slack.size:
        x = shape.points[shape.mesh.droppers[slack, 0], 0]
        listed = ", ".join(f"{a:.2f} m ({f:.1f} N)" for a, f in list(zip(x, force[slack], strict=True))[:8])
        curve = "" if shape.definition.track is None else (
            "; in a curve the steady arms pull harder and lift the wire: give them less slope (arm_angle in [supports])"
        )  # fmt: skip
        raise EquilibriumError(
            f"line '{shape.definition.name}': {slack.size} dropper(s) would have to push to give the wanted profile: "
            f"{listed}; reduce the pre-sag or the rise to the anchors, or move the droppers{curve}"
        )


def _check_arms(shape: LineShape, force: FloatArray) -> None:
    """Reject steady arms that push."""
    pushing = np.flatnonzero(pushing_arms(shape, force))
    if pushing.size:
        x = shape.points[shape.mesh.arms[pushing, 1], 0]
        listed = ", ".join(
            f"the arm at {a:.2f} m pushes with {-f:.1f} N" for a, f in list(zip(x, force[pushing], strict=True))[:8]
        )
        is_drawn = shape.definition.irregularity.stagger_sigma and np.isfinite(shape.mesh.given_length).any()
        drawn = ", or take a smaller irregularity.stagger_sigma or another seed" if is_drawn else ""
        raise EquilibriumError(
            f"line '{shape.definition.name}': {listed}: an arm must pull; change its side "
            f"(arm_side in [supports]) or the stagger{drawn}"
        )


def _residual(shape: LineShape, displacement: FloatArray, force: FloatArray) -> float:
    matrices = shape.matrices
    unbalanced = matrices.K @ displacement + shape.droppers.rows.T @ force - matrices.load
    translations = unbalanced.reshape(-1, NODE_DOFS)[:, :3][~shape.mesh.fixed[:, :3]]
    return float(np.abs(translations).max() / weight(matrices))
