"""A line as it hangs, from its design and a measuring run: dropper lengths as fitted, with their uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.condition.fitted_lengths import FittedLengths, droppers_along, find_fitted_lengths
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import CatenaryMesh, build_mesh
from models.catenary.statics.dropper_influence import dropper_influence
from models.catenary.statics.wire_course import HeldShapes, WireCourse, held_shapes, section_alone, wire_courses
from models.layout.as_built.alignment import Alignment, align
from models.layout.as_built.measured_run import AsBuiltError, MeasuredRun, worn_depth
from models.layout.as_built.wire_deviation import WireDeviation, wire_deviation

#: Heights that differ from the design by more than this, half of them, are of another line or in another unit [m].
_ANOTHER_LINE: Final = 0.3
#: Errors up to which both ways are compared [m].
COMPARED: Final = 0.0101
#: Near a slack dropper heights do not follow lengths in proportion [m].
_NEAR: Final = 120.0
#: How often the alignment is refined by the heights, and the farthest that this may move a row [m].
_REFINED: Final = 2
_FARTHEST: Final = 1.0
#: Heights whose equations are worse than this say nothing of the positions.
_BLIND: Final = 1e8
#: Droppers that carry more are not slack, however the heights were measured [N].
_LIGHT: Final = 30.0
#: Rows solved for at a time.
_AT_A_TIME: Final = 64

#: What is told of progress: what is done, how much of it, of how much.
Tell = Callable[[str, int, int], None]


def silent(what: str, done: int, whole: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True)
class AsBuilt:
    """A line as it hangs; arrays over its droppers (without hangers), section by section along the track.

    Attributes
    ----------
    design : StaticState
    fitted : FittedLengths
        The line as it hangs, its lengths in the order of the mesh.
    run : MeasuredRun
    alignment : Alignment
    deviations : tuple of WireDeviation or None
        Of every section, None where nothing was measured.
    droppers : ndarray, shape (k,)
        Places in the mesh.
    x, wanted, height : ndarray, shape (k,)
        Where they are, height of the wire there in the design, and as measured (NaN: not measured) [m].
    error, uncertainty : ndarray, shape (k,)
        Length as fitted minus designed, and its standard error [m]; NaN where not measured, the latter also where
        there are too few heights to tell, or it hangs loose.
    is_slack : ndarray, shape (k,)
        Droppers that carry nothing, or too little to tell: their error is what is given, or more.
    influence : sparse, shape (k, k)
        Rise of the wire by unit lengths, about the line as it hangs.
    difference : float
        Largest difference between form finding and -J^-1 of errors up to 10 mm [m]; NaN if there was none to compare.
    """

    design: StaticState
    fitted: FittedLengths
    run: MeasuredRun
    alignment: Alignment
    deviations: tuple[WireDeviation | None, ...]
    droppers: IntArray
    x: FloatArray
    wanted: FloatArray
    height: FloatArray
    error: FloatArray
    uncertainty: FloatArray
    is_slack: BoolArray
    influence: sp.csc_matrix
    difference: float

    @property
    def definition(self) -> CatenaryDefinition:
        """Return the design's definition."""
        return self.design.shape.definition

    @property
    def is_measured(self) -> BoolArray:
        """Return which droppers were measured, shape (k,)."""
        return np.isfinite(self.height)

    def heights(self, state: StaticState) -> FloatArray:
        """Return the heights of the wire at the droppers in a state of the line, shape (k,) [m]."""
        lower = state.shape.mesh.droppers[self.droppers, 0]
        return np.asarray(state.positions[lower, 2])


def find_as_built(definition: CatenaryDefinition, run: MeasuredRun, tell: Tell = silent) -> AsBuilt:
    """Find the dropper lengths as fitted from a measuring run.

    Raises
    ------
    AsBuiltError
        If the definition is no design, or the run says nothing reliable of it.
    EquilibriumError
        If the line has no equilibrium as designed or as measured.
    """
    check_design(definition)
    tell("form finding of the design", 0, 1)
    design = kept_form(definition, build_mesh(definition))
    courses = wire_courses(design)
    tell("alignment", 0, 1)
    held = [held_shapes(design, s, _held_nodes(design, s)) for s in range(len(courses))]
    alignment = align(run, definition, courses)
    deviations = tuple(_deviations(design, run, alignment.position(run.position), courses, held))
    for _ in range(_REFINED):
        if (way := _way(alignment, deviations, courses)) is not None:
            alignment = _moved(alignment, way)
            deviations = tuple(_deviations(design, run, alignment.position(run.position), courses, held))
    droppers = np.concatenate([droppers_along(design.shape.mesh, s) for s in range(len(courses))])
    lower = design.shape.mesh.droppers[droppers, 0]
    x, wanted = design.positions[lower, 0], design.positions[lower, 2]
    section = design.shape.mesh.section[lower]
    height = wanted + _at_droppers(deviations, section, x)
    if not np.isfinite(height).any():
        raise AsBuiltError(f"{run.source}: no dropper has enough measured heights on both sides of it")
    tell("lengths as fitted", 0, 1)
    everywhere = np.full(len(design.unstrained_length), np.nan)
    everywhere[droppers] = height
    fitted = find_fitted_lengths(design, everywhere)
    influence = dropper_influence(
        fitted.state, droppers, lambda done: tell("influence of lengths", done, len(droppers))
    )
    measured = np.isfinite(height)
    error = np.where(measured, (fitted.state.unstrained_length - design.unstrained_length)[droppers], np.nan)
    return AsBuilt(
        design=design,
        fitted=fitted,
        run=run,
        alignment=alignment,
        deviations=deviations,
        droppers=droppers,
        x=x,
        wanted=wanted,
        height=height,
        error=error,
        uncertainty=_uncertainty(deviations, _way(alignment, deviations, courses), section, x, error, influence, tell),
        is_slack=fitted.is_slack[droppers] | _nearly_slack(fitted.state, deviations, droppers, measured),
        influence=influence,
        difference=_difference(height - wanted, error, x, fitted.is_slack[droppers], influence),
    )


def check_design(definition: CatenaryDefinition) -> None:
    """Refuse a definition that is not the design alone; raises ``AsBuiltError``."""
    name = f"line '{definition.name}'"
    if any(section.periodic for section in definition.sections):
        raise AsBuiltError(f"{name} closes on itself, which no line does that is measured: give the line with its ends")
    if any(section.length_errors for section in definition.sections):
        raise AsBuiltError(f"{name} has a table [as_built] already: give its design, without that table")
    if definition.running_surface is not None:
        raise AsBuiltError(f"{name} has a running surface of its own: give its design, without [running_surface]")
    errors = definition.irregularity
    if errors.dropper_length_sigma or errors.support_height_sigma or any(f.active for f in definition.fault):
        raise AsBuiltError(
            f"{name} has errors of its own ([irregularity] or an active [[fault]]): give the design alone"
        )
    if definition.tensioning is not None and not definition.tensioning.is_design:
        raise AsBuiltError(
            f"{name} is at another temperature than it was designed for: give it without the table [tensioning], or at "
            "its reference_temperature and with direction 0"
        )


def _deviations(
    design: StaticState,
    run: MeasuredRun,
    x: FloatArray,
    courses: tuple[WireCourse, ...],
    held: Sequence[HeldShapes],
) -> Iterator[WireDeviation | None]:
    """Yield how far the measured wire is from the design's, section by section, where a wire is alone."""
    which = np.where(np.isfinite(run.height), section_alone(courses, x), -1)
    if (which < 0).all():
        named = any(s.structure for section in design.shape.definition.sections for s in section.supports)
        cure = "; the run names structures, and the design none: name them in its [supports]"
        raise AsBuiltError(
            f"{run.source}: no row lies on the line, which reaches from {min(c.x[0] for c in courses):.1f} to "
            f"{max(c.x[-1] for c in courses):.1f} m; the run from {x.min():.1f} to {x.max():.1f} m"
            f"{cure if any(run.structure) and not named else ''}"
        )
    axis = run.height - worn_depth(design.shape.definition, run)
    for index, course in enumerate(courses):
        here = which == index
        if not here.any():
            yield None
            continue
        deviation = axis[here] - course.height(x[here])
        typical = float(np.median(deviation))
        if abs(typical) > _ANOTHER_LINE:
            raise AsBuiltError(
                f"{run.source}: the heights differ by {typical:+.2f} m from those of the design: is this the line, and "
                "are they metres above the rails?"
            )
        yield wire_deviation(x[here], deviation, held[index].knots, held[index].at(x[here]))


@dataclass(frozen=True)
class _Way:
    """How errors of the positions enter: a shift and a stretch about the middle, both in metres (at the ends).

    Attributes
    ----------
    courses : tuple of ndarray, shape (k, 2), or None
        What a metre of each adds to the courses of the sections' wires [m].
    found : ndarray, shape (2,)
        What heights say of them [m].
    covariance : ndarray, shape (2, 2)
        [m^2].
    """

    courses: tuple[FloatArray | None, ...]
    found: FloatArray
    covariance: FloatArray


def _way(
    alignment: Alignment, deviations: tuple[WireDeviation | None, ...], courses: tuple[WireCourse, ...]
) -> _Way | None:
    """Return what the heights say of the positions: where the wire has its kinks, beside where its droppers are.

    A row that was taken a little too far back shows the height there plus the way times the slope of the wire, whose
    jumps at the droppers no change of lengths explains.
    """
    if not alignment.is_straight:
        return None
    middle, half = 0.5 * (alignment.design[0] + alignment.design[-1]), 0.5 * np.ptp(alignment.design)
    explained: list[FloatArray | None] = []
    normal, right, sigma = np.zeros((2, 2)), np.zeros(2), []
    for deviation, course in zip(deviations, courses, strict=True):
        if deviation is None or not np.isfinite(deviation.sigma):
            explained.append(None)
            continue
        slope = course.slope(deviation.x)
        own, rest = deviation.course_of(np.stack([slope, slope * (deviation.x - middle) / half], axis=1))
        explained.append(own)
        normal += rest.T @ rest
        right += rest.T @ deviation.left
        sigma.append(deviation.sigma)
    if not sigma or np.linalg.cond(normal) > _BLIND:
        return None
    covariance = float(np.mean(sigma)) ** 2 * np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return _Way(tuple(explained), np.asarray(np.linalg.solve(normal, right), dtype=np.float64), covariance)


def _moved(alignment: Alignment, way: _Way) -> Alignment:
    """Return the alignment with what the heights say of it, unless that is far."""
    shift, stretch = way.found.tolist()
    if max(abs(shift), abs(stretch)) > _FARTHEST:
        return alignment
    return alignment.moved(shift, stretch / (0.5 * np.ptp(alignment.design)), float(np.sqrt(way.covariance[0, 0])))


def _held_nodes(design: StaticState, section: int) -> IntArray:
    """Return the nodes where something holds the contact wire of a section, along the track, its ends among them."""
    mesh = design.shape.mesh
    ends = mesh.contact_chains()[section].nodes[[0, -1]]
    hung = mesh.droppers[droppers_along(mesh, section), 0]
    nodes = np.unique(np.concatenate([hung, _arm_nodes(mesh, section), ends]))
    return np.asarray(nodes[np.argsort(design.positions[nodes, 0], kind="stable")])


def _arm_nodes(mesh: CatenaryMesh, section: int) -> IntArray:
    nodes = mesh.arms[:, 1]
    return nodes[mesh.section[nodes] == section]


def _at_droppers(deviations: tuple[WireDeviation | None, ...], section: IntArray, x: FloatArray) -> FloatArray:
    """Return the deviation at every dropper, shape (k,) [m]; NaN where too little was measured."""
    result = np.full(len(x), np.nan)
    for index, deviation in enumerate(deviations):
        if deviation is not None:
            here = np.flatnonzero(section == index)
            knots = _nearest(deviation.knots, x[here])
            result[here] = np.where(deviation.is_measured, deviation.value, np.nan)[knots]
    return result


def _nearest(knots: FloatArray, x: FloatArray) -> IntArray:
    after = np.clip(np.searchsorted(knots, x), 1, len(knots) - 1)
    return after - (x - knots[after - 1] < knots[after] - x)


def _uncertainty(
    deviations: tuple[WireDeviation | None, ...],
    way: _Way | None,
    section: IntArray,
    x: FloatArray,
    error: FloatArray,
    influence: sp.csc_matrix,
    tell: Tell,
) -> FloatArray:
    """Return the standard errors of the lengths [m], shape (k,): those of heights and positions through J^-1.

    Droppers that were not measured have errors like the others', which reach a little into the heights beside them.
    """
    result, measured = np.full(len(x), np.nan), np.isfinite(error)
    acts = influence.diagonal() != 0.0
    usual = float(np.mean(error[measured] ** 2))
    for index, deviation in enumerate(deviations):
        here = np.flatnonzero((section == index) & measured & acts)
        if deviation is None or not here.size or not np.isfinite(deviation.sigma):
            continue
        inverse = splu(sp.csc_matrix(influence[here][:, here].T))
        from_others = influence[here][:, np.flatnonzero((section == index) & ~measured)].T
        knots = _nearest(deviation.knots, x[here])
        for start in range(0, len(here), _AT_A_TIME):
            some = np.arange(start, min(start + _AT_A_TIME, len(here)))
            unit = np.zeros((len(here), len(some)))
            unit[some, np.arange(len(some))] = 1.0
            rows = np.zeros((len(some), len(deviation.knots)))
            through = inverse.solve(unit)
            rows[:, knots] = through.T
            others = usual * np.sum((from_others @ through) ** 2, axis=0)
            variance = deviation.covariance(rows) + others
            if way is not None and (own := way.courses[index]) is not None:
                by_way = rows @ own
                variance += np.einsum("ma,ab,mb->m", by_way, way.covariance, by_way)
            result[here[some]] = np.sqrt(variance)
            tell("uncertainty", int(here[some[-1]]) + 1, len(x))
    return result


def _nearly_slack(
    state: StaticState, deviations: tuple[WireDeviation | None, ...], droppers: IntArray, measured: BoolArray
) -> BoolArray:
    """Return which droppers carry less than twice the standard error of their force, shape (k,).

    What a dropper carries more than designed is the contact wire's tension times the bend of its deviation there.
    """
    result = np.zeros(len(droppers), dtype=np.bool_)
    lower = state.shape.mesh.droppers[droppers, 0]
    section, tension = state.shape.mesh.section[lower], state.shape.definition.contact_wire.tension
    x, force = state.positions[lower, 0], state.dropper_force[droppers]
    for index, deviation in enumerate(deviations):
        light = np.flatnonzero((section == index) & measured & (force < _LIGHT))
        if deviation is None or not light.size or not np.isfinite(deviation.sigma):
            continue
        knots = _nearest(deviation.knots, x[light])
        rows, each = np.zeros((len(light), len(deviation.knots))), np.arange(len(light))
        before, after = (tension / np.abs(deviation.knots[knots] - deviation.knots[knots + k]) for k in (-1, 1))
        rows[each, knots - 1], rows[each, knots], rows[each, knots + 1] = -before, before + after, -after
        result[light] = force[light] < 2.0 * np.sqrt(deviation.covariance(rows))
    return result


def _difference(
    rise: FloatArray, error: FloatArray, x: FloatArray, slack: BoolArray, influence: sp.csc_matrix
) -> float:
    """Return by how much J^-1 of the heights differs from form finding, of errors up to 10 mm [m]."""
    measured = np.isfinite(rise) & (influence.diagonal() != 0.0)
    other = np.zeros(len(x))
    if measured.any():
        other[measured] = splu(sp.csc_matrix(influence[measured][:, measured])).solve(rise[measured])
    near = np.abs(x[:, None] - x[slack][None, :]).min(axis=1, initial=np.inf) < _NEAR
    with np.errstate(invalid="ignore"):
        compared = measured & ~near & (np.abs(error) <= COMPARED)
    if not compared.any():
        return float("nan")
    return float(np.abs(other - error)[compared].max())
