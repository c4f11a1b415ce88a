"""Many runs of one line with lumped pantographs, side by side, as a co-simulation by the scheme jacobi would make them.

Every run is a lane. `run_lanes` makes them in compiled kernels, a block of lanes at a time (`lane_block`); `run_singly`
makes the same runs one after the other from the parts that FMUs are made of, and is what the kernels are compared with.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.contact_and_slack.local_problem import LocalSolutionError
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import wires_at_rest
from models.catenary.line_state import ContactResult, StripMotion
from models.catenary.strip_checks import check_strips
from models.contact_law import application_point
from models.coupled.lane_block import LaneBlock
from models.definition_files.parameter import ParameterError
from models.numerics.extrapolation import StripExtrapolation
from models.numerics.newmark import steps_within
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_part import LumpedPantographPart


@dataclass(frozen=True)
class Lane:
    """A run: its pantographs and its number of macro steps."""

    pantographs: tuple[LumpedDefinition, ...]
    steps: int


@dataclass(frozen=True)
class LanePlan:
    """What all runs have in common.

    Attributes
    ----------
    start, step : float
        Start time and macro step [s].
    every : int
        Steps between two records of the droppers; 0 for none.
    with_forces : bool
        Whether their forces are recorded, not just whether they are slack.
    """

    start: float = 0.0
    step: float = 1e-3
    every: int = 10
    with_forces: bool = False


@dataclass
class LaneRecord:
    """What was computed of a run: a row at its start and one after every step.

    Attributes
    ----------
    number : int
        Which lane, from 0.
    failure : str
        Why it did not come to its end; empty if it did.
    contact : ndarray, shape (n, P, 4 + sections)
        Contact force [N], its point of application [m], the force on every wire [N].
    strip : ndarray, shape (n, P, 4)
        x, z [m], vx, vz [m/s] of the strips.
    uplift : ndarray, shape (n, n_supports)
        [m]
    slack : ndarray of bool, shape (k, n_droppers)
        Which droppers are slack, at every ``every``-th step.
    dropper_force : ndarray, shape (k, n_droppers)
        What they carry [N]; no rows if not recorded.
    """

    number: int
    failure: str
    contact: FloatArray
    strip: FloatArray
    uplift: FloatArray
    slack: BoolArray
    dropper_force: FloatArray


@dataclass
class _Rows:
    """A record that grows."""

    number: int
    lane: Lane
    contact: list[FloatArray] = field(default_factory=list)
    strip: list[FloatArray] = field(default_factory=list)
    uplift: list[FloatArray] = field(default_factory=list)
    slack: list[BoolArray] = field(default_factory=list)
    force: list[FloatArray] = field(default_factory=list)

    def add(self, contact: FloatArray, strip: FloatArray, uplift: FloatArray) -> None:
        """Take a row; the arrays are kept as they are."""
        self.contact.append(contact)
        self.strip.append(strip)
        self.uplift.append(uplift)

    @property
    def steps(self) -> int:
        """Return how many steps were made."""
        return len(self.contact) - 1

    def record(self, droppers: int, failure: str = "") -> LaneRecord:
        """Return what was recorded."""
        slack = np.array(self.slack, dtype=np.bool_).reshape(-1, droppers)
        force = np.array(self.force).reshape(-1, droppers)
        contact, strip, uplift = (np.array(rows) for rows in (self.contact, self.strip, self.uplift))
        return LaneRecord(self.number, failure, contact, strip, uplift, slack, force)


def run_lanes(
    model: CatenaryModel,
    lanes: Sequence[Lane],
    plan: LanePlan,
    progress: Callable[[int], None] = lambda _: None,
) -> Iterator[LaneRecord]:
    """Make runs side by side and yield each when it has ended; a lane that is free takes the next run.

    Parameters
    ----------
    model : CatenaryModel
    lanes : sequence of Lane
        All with as many pantographs.
    plan : LanePlan
    progress : callable
        Called after every step of a block with the number of runs under way.

    Raises
    ------
    ImportError
        If numba is not installed.
    """
    if not lanes:
        return
    masses = max(len(p.stage) for lane in lanes for p in lane.pantographs)
    block = LaneBlock(model, len(lanes[0].pantographs), plan.start, plan.step, masses)
    droppers = len(model.dropper_law.stiffness)
    # The longest first: then the last ones end nearly together.
    waiting = sorted(range(len(lanes)), key=lambda i: lanes[i].steps)
    going: dict[int, _Rows] = {}
    while waiting or going:
        for place in range(block.lanes):
            while waiting and place not in going:
                rows = _Rows(waiting[-1], lanes[waiting.pop()])
                block.enter(place, rows.lane.pantographs)
                if reason := _misplaced(model, block.strips_at(place), block.contact[place, :, 0]):
                    block.leave(place)
                    yield rows.record(droppers, reason)
                    continue
                going[place] = rows
                _note(block, place, rows, plan, block.contact.copy(), block.strip.copy(), block.uplift)
        if not going:
            return
        block.step()
        contact, strip, uplift = block.contact.copy(), block.strip.copy(), block.uplift
        for place, rows in list(going.items()):
            failure = block.failure(place)
            if not failure:
                _note(block, place, rows, plan, contact, strip, uplift)
            if failure or rows.steps == rows.lane.steps:
                block.leave(place)
                yield going.pop(place).record(droppers, failure)
        progress(len(going))


def _note(
    block: LaneBlock,
    place: int,
    rows: _Rows,
    plan: LanePlan,
    contact: FloatArray,
    strip: FloatArray,
    uplift: FloatArray,
) -> None:
    rows.add(contact[place], strip[place], uplift[place])
    if plan.every and rows.steps % plan.every == 0:
        rows.slack.append(block.slack(place))
        if plan.with_forces:
            rows.force.append(block.dropper_force(place))


def _misplaced(model: CatenaryModel, strips: FloatArray, force: FloatArray) -> str:
    """Return why strips cannot be meant for a line at rest, empty if they can."""
    try:
        check_strips(wires_at_rest(model), strips, force)
    except ParameterError as error:
        return str(error)
    return ""


def run_singly(model: CatenaryModel, lanes: Sequence[Lane], plan: LanePlan) -> Iterator[LaneRecord]:
    """Make runs one after the other from a line and the parts of lumped pantographs; yields what `run_lanes` does."""
    for number, lane in enumerate(lanes):
        yield _Single(model, lane, plan).run(number)


class _Single:
    """One run: a line as `CatenaryPart` steps it, on a model that all runs share, and its pantographs."""

    def __init__(self, model: CatenaryModel, lane: Lane, plan: LanePlan) -> None:
        self._model, self._lane, self._plan = model, lane, plan
        self._trains = [LumpedPantographPart(definition) for definition in lane.pantographs]
        self._state = model.initial_state(len(self._trains))
        order = model.definition.extrapolation_order
        self._known = [StripExtrapolation(order) for _ in self._trains]
        self._time, self._base = plan.start, np.zeros(2)

    def run(self, number: int) -> LaneRecord:
        """Make the run."""
        model, plan = self._model, self._plan
        rows, droppers = _Rows(number, self._lane), len(model.dropper_law.stiffness)
        for train in self._trains:
            train.initialise(plan.start, 0.0, np.zeros(3), self._base)
        strips = self._strips
        contact = self._published(model.contact_at_rest(self._state, strips), strips)
        if reason := _misplaced(model, strips, contact[:, 0]):
            return rows.record(droppers, reason)
        for train, known, strip, acting in zip(self._trains, self._known, strips, contact, strict=True):
            train.initialise(plan.start, float(acting[0]), acting[1:4], self._base)
            known.start(plan.start, strip)
        self._note(rows, contact)
        try:
            for _ in range(self._lane.steps):
                contact = self._step(contact)
                self._note(rows, contact)
        except LocalSolutionError as error:
            return rows.record(droppers, str(error))
        return rows.record(droppers)

    @property
    def _strips(self) -> FloatArray:
        return np.array([train.strip for train in self._trains])

    def _step(self, contact: FloatArray) -> FloatArray:
        """Make a macro step in which all get what the others had at its beginning; return the contacts at its end."""
        model, step, strips = self._model, self._plan.step, self._strips
        count = steps_within(step, model.definition.time_step)
        h, motion = step / count, StripMotion(np.zeros_like(strips), np.zeros(len(strips)))
        for known, strip in zip(self._known, strips, strict=True):
            known.receive(self._time, strip, step)
        for k in range(1, count + 1):
            for known, strip in zip(self._known, motion.strip, strict=True):
                known.at(self._time + k * h, strip)
            result = model.step(self._state, h, motion)
        for train, acting in zip(self._trains, contact, strict=True):
            train.step(float(acting[0]), acting[1:4], self._base, step)
        self._time += step
        return self._published(result, motion.strip)

    @staticmethod
    def _published(result: ContactResult, strips: FloatArray) -> FloatArray:
        points = [application_point(*each) for each in zip(result.force, result.point, strips, strict=True)]
        return np.concatenate([result.force.sum(axis=1)[:, None], np.array(points), result.force], axis=1)

    def _note(self, rows: _Rows, contact: FloatArray) -> None:
        model, state, plan = self._model, self._state, self._plan
        strips = self._strips
        middle = np.concatenate([strips[:, 0, 0, [0, 2]], strips[:, 0, 1, [0, 2]]], axis=1)
        rows.add(contact, middle, model.uplift(state).copy())
        if plan.every and rows.steps % plan.every == 0:
            rows.slack.append(model.dropper_slack(state))
            if plan.with_forces:
                rows.force.append(model.dropper_force(state))
