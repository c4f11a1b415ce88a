"""Runs of one line that step side by side in compiled kernels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.condition.running_surface import RunningSurface
from models.catenary.line_model import CatenaryModel
from models.coupled.lane_matrices import LaneMatrices
from models.definition_files.parameter import ParameterError
from models.numerics.kernel_cache import joined, load_kernels
from models.numerics.newmark import Newmark, steps_within
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_model import LumpedModel

if TYPE_CHECKING:  # they are compiled from copies, see `kernel_cache`
    from models.coupled import lanes_contact_kernels as _c  # noqa: F401
    from models.coupled import lanes_linear_kernels as _l  # noqa: F401
    from models.coupled import lanes_train_kernels as _t  # noqa: F401

_HERE: Final = Path(__file__).parent
_STEP: Final = _HERE.parent / "catenary" / "step"
#: Their files by name, each after those that it imports.
_KERNEL_FILES: Final = {
    "linear": (_STEP / "vector_kernels.py", _HERE / "lane_forms_kernels.py", _HERE / "lanes_linear_kernels.py"),
    "contact": (
        _STEP / "vector_kernels.py",
        _STEP / "law_kernels.py",
        _HERE / "lane_forms_kernels.py",
        _HERE / "lanes_contact_kernels.py",
    ),
    "train": (_HERE / "lane_forms_kernels.py", _HERE / "lanes_train_kernels.py"),
}
#: Texts for what the kernels return for a lane.
_FAILURES: Final = {
    1: "slack and contact forces have not settled; use a smaller time step",
    2: "slack and contact forces have no solution: their compliances are singular",
}


def kernels(part: str) -> ModuleType:
    """Return compiled kernels of lanes: ``linear``, ``contact`` or ``train``; raises ``ImportError`` without numba."""
    return load_kernels(f"lanes_{part}", joined(_KERNEL_FILES[part]))


def _common_surface(model: CatenaryModel) -> RunningSurface | None:
    """Return the running surface of the one contact wire, None if there is none.

    Raises
    ------
    ParameterError
        If there are several wires: each has its own.
    """
    surfaces = [wire.surface for wire in model.wires]
    if len(surfaces) > 1 and any(surfaces):
        raise ParameterError(
            f"line '{model.definition.name}' has several contact wires with running surfaces, and runs side by side "
            "take a line of one section then: run scenarios one by one, or leave the running surface out"
        )
    return surfaces[0]


class LaneBlock:
    """A few runs of one line, a lane each, that make macro steps of the co-simulation's scheme jacobi together.

    Every lane has its own pantographs, clock and end: `enter` begins a run in a lane, `leave` ends it, whatever the
    others do.

    Parameters
    ----------
    model : CatenaryModel
    pantographs : int
        Of every lane, P.
    start, step : float
        Start time of all runs and macro step [s].
    masses : int
        Most masses of a pantograph.

    Attributes
    ----------
    lanes : int
        How many there are.
    contact : ndarray, shape (lanes, P, 4 + sections)
        Contact force [N], its point of application [m], the force on every wire [N].
    strip : ndarray, shape (lanes, P, 4)
        x, z [m], vx, vz [m/s] of the strips.

    Raises
    ------
    ImportError
        If numba is not installed.
    """

    def __init__(self, model: CatenaryModel, pantographs: int, start: float, step: float, masses: int = 3) -> None:
        definition = model.definition
        self._linear, self._contact, self._train = (kernels(part) for part in ("linear", "contact", "train"))
        self._count = steps_within(step, definition.time_step)
        self._start, self._step, self._h = start, step, step / self._count
        self._order = definition.extrapolation_order
        self._model = model
        self._matrices = LaneMatrices(model, self._h, self._linear, self._contact)
        self.lanes: int = self._linear.BLOCK
        self._allocate(pantographs, len(model.wires), len(model.modes.attached))
        self._trains = self._new_trains(pantographs, masses)
        self._surface = _common_surface(model)

    def enter(self, lane: int, pantographs: Sequence[LumpedDefinition]) -> None:
        """Begin a run in a lane: line and pantographs at rest, contacts found."""
        state, memory, trains = self._state, self._memory, self._trains
        for array in (state.table, state.attached, state.pull, state.change):
            array[..., lane] = 0.0
        slack = np.flatnonzero(self._model.dropper_law.rest_compensation)
        memory.slack_count[lane] = len(slack)
        memory.slack[lane, : len(slack)] = slack
        memory.lacking[lane, : len(slack)] = self._model.dropper_law.rest_compensation[slack]
        of_lane = slice(lane * self._places, (lane + 1) * self._places)
        memory.element[of_lane], memory.impact[of_lane] = -1, 0.0
        memory.status[lane] = 0
        for p, definition in enumerate(pantographs):
            self._set(lane, p, definition)
        self.times[lane] = self._start
        self._train.start(trains, lane, self._start, np.zeros(len(pantographs)))
        self._train.continue_strips(trains, self._only(lane), self.times, 0.0, 0, self._strips)
        m = self._matrices
        self._contact.stand(
            lane, self._on_surface()[lane], m.law, m.loads, m.wires, memory, state, self._work, self.contact[lane]
        )
        self._train.start(trains, lane, self._start, self.contact[lane, :, 0].copy())
        memory.active[lane] = 1

    def leave(self, lane: int) -> None:
        """End the run in a lane; its arrays may be anything afterwards."""
        self._memory.active[lane] = 0
        for array in (self._state.table, self._state.attached, self._state.pull, self._state.known):
            array[..., lane] = 0.0

    def step(self) -> None:
        """Let all lanes make a macro step."""
        m, memory, state, trains, times = self._matrices, self._memory, self._state, self._trains, self.times
        before = self.contact[:, :, :2].copy()
        self._train.receive(trains, memory.active, times, self._step, self._order)
        for k in range(1, self._count + 1):
            self._train.continue_strips(trains, memory.active, times, k * self._h, self._order, self._strips)
            self._begin()
            self._linear.pull_droppers(m.linear, m.droppers, self._motion)
            self._contact.meet_all(self._on_surface(), m.law, m.unilateral, m.wires, memory, state, self._work)
            self._linear.finish(m.linear, self._motion)
            self._contact.conclude(self._strips, m.loads, m.wires, memory, state, self._work, self.contact)
        self._train.step_trains(trains, memory.active, times, self._start, self._step, before)
        times += self._step

    @property
    def strip(self) -> FloatArray:
        """Return x, z [m], vx, vz [m/s] of the strips, shape (lanes, P, 4)."""
        strip: FloatArray = self._trains.strip
        return strip

    def strips_at(self, lane: int) -> FloatArray:
        """Return the strips of a lane as a line receives them, shape (P, 2, 2, 3)."""
        x, z, vx, vz = self.strip[lane].T
        kernel, setting = self._train, self._trains.setting[lane]
        result = np.zeros((len(x), 2, 2, 3))
        for end, place in enumerate((kernel.LEFT, kernel.RIGHT)):
            result[:, end, 0] = np.stack([x, setting[:, place], z], axis=1)
            result[:, end, 1, 0], result[:, end, 1, 2] = vx, vz
        return result

    @property
    def uplift(self) -> FloatArray:
        """Return the rise of the contact wires at the supports [m], shape (lanes, n_supports)."""
        return np.ascontiguousarray(self._state.attached[self._model.uplift_places, 0].T)

    def slack(self, lane: int) -> BoolArray:
        """Return which droppers of a lane are slack, shape (n_droppers,)."""
        result = np.zeros(len(self._matrices.unilateral), dtype=np.bool_)
        result[self._slack(lane)] = True
        return result

    def dropper_force(self, lane: int) -> FloatArray:
        """Return what the droppers of a lane carry [N], shape (n_droppers,)."""
        attached = np.ascontiguousarray(self._state.attached[:, :, lane].T)
        slack = self._slack(lane)
        return self._model.dropper_law.force(attached, slack, self._memory.lacking[lane, : len(slack)])

    def failure(self, lane: int) -> str:
        """Return why a lane cannot go on; empty if it can."""
        if status := int(self._memory.status[lane]):
            return _FAILURES[status]
        found = self.contact[lane].sum() + self.strip[lane].sum()
        return "" if np.isfinite(found) else "forces or positions are no longer finite; use a smaller time step"

    def _slack(self, lane: int) -> IntArray:
        slack: IntArray = self._memory.slack[lane, : self._memory.slack_count[lane]]
        return slack

    def _begin(self) -> None:
        m = self._matrices
        if m.factor is None:
            self._linear.begin(m.linear, self._motion)
        else:
            self._linear.load(m.linear, self._motion)
            self._state.change[...] = m.factor.solve(self._state.change)

    def _on_surface(self) -> FloatArray:
        """Return the strips as wires meet them, of whose running surface the kernels know nothing: so much lower."""
        if self._surface is None:
            return self._strips
        strips, speed = self._strips.copy(), self._trains.setting[:, :, self._train.SPEED]
        for strip, v in zip(strips.reshape(-1, strips.shape[-1]), speed.ravel().tolist(), strict=True):
            height, slope = self._surface.at(float(strip[0]))
            strip[3] -= height
            strip[4] -= v * slope
        return strips

    def _only(self, lane: int) -> IntArray:
        result = np.zeros(self.lanes, dtype=np.int64)
        result[lane] = 1
        return result

    def _set(self, lane: int, p: int, definition: LumpedDefinition) -> None:
        """Put a pantograph's numbers into the arrays."""
        kernel, trains, n = self._train, self._trains, len(definition.stage)
        model, count = LumpedModel(definition), steps_within(self._step, definition.time_step)
        newmark = Newmark(self._step / count)
        trains.masses[lane, p], trains.steps[lane, p], trains.length[lane, p] = n, count, newmark.step
        trains.mass[lane, p, :n] = np.diag(model.M)
        trains.damping[lane, p, :n, :n] = model.C
        trains.air[lane, p, :n] = np.array(definition.air_shares) * definition.aerodynamic_force(0.0)
        trains.inverse[lane, p, :n, :n] = np.linalg.inv(model.K + newmark.a0 * model.M + newmark.a1 * model.C)
        half, middle = 0.5 * definition.strip_length, definition.strip_offset
        values = {
            kernel.POSITION: definition.start_position,
            kernel.SPEED: definition.speed,
            kernel.HEIGHT: definition.reference_height,
            kernel.STATIC_FORCE: definition.static_force,
            kernel.RAISE_START: definition.raise_start,
            kernel.RAISE_DURATION: definition.raise_duration,
            kernel.LEFT: middle + half,
            kernel.RIGHT: middle - half,
            kernel.ORDER: float(definition.extrapolation_order),
        }
        for place, value in values.items():
            trains.setting[lane, p, place] = value

    def _allocate(self, P: int, sections: int, n: int) -> None:
        K, m, linear, contact = self.lanes, self._matrices, self._linear, self._contact
        coordinates, ends, reached = m.most
        droppers, places = len(m.unilateral), P * sections
        margin = (m.linear.lower.shape[1] - 1) * K
        table, whole = np.zeros(m.linear.modes.shape[0] * 3 * K), np.zeros(n * K + 2 * margin)
        attached, known, change = np.zeros(2 * n * K), np.zeros(n * K), whole[margin : len(whole) - margin]
        moved, pull, pulls = np.zeros(m.ends * K), np.zeros(m.ends * K), np.zeros(droppers * K)
        self._motion = linear.Motion(table, attached, known, whole, moved, pull, pulls)
        by_lane = [array.reshape(-1, K) for array in (known, change, pull, pulls)]
        self._state: Any = contact.Motion(
            np.array([m.linear.a1]),
            m.linear.modes,
            m.linear.rates,
            m.linear.slot_end,
            table.reshape(-1, 3, K),
            attached.reshape(-1, 2, K),
            *by_lane,
        )
        q, whole_number, most = K * places, np.int64, places + droppers
        self._places = places
        self._memory: Any = contact.Memory(
            active=np.zeros(K, whole_number),
            status=np.zeros(K, whole_number),
            element=np.full(q, -1),
            impact=np.zeros(q),
            interval=np.full(q, -1),
            force=np.zeros(q),
            row=np.zeros((q, coordinates)),
            load=np.zeros((q, ends)),
            slack_count=np.zeros(K, whole_number),
            slack=np.zeros((K, droppers), whole_number),
            lacking=np.zeros((K, droppers)),
        )
        self._work = contact.Work(
            met=np.zeros((q, contact.MET)),
            row=np.zeros((q, coordinates)),
            load=np.zeros((q, ends)),
            local=np.zeros((2, coordinates)),
            place=np.zeros(4),
            response=np.zeros(reached),
            by_contact=np.zeros((places, droppers)),
            by_slack=np.zeros((droppers, droppers)),
            on_contacts=np.zeros((places, droppers)),
            compliance=np.zeros((places, places)),
            system=np.zeros((most, most)),
            change=np.zeros(most),
            pull=np.zeros(droppers),
            force=np.zeros(places),
            penetration=np.zeros(places),
            velocity=np.zeros(places),
            closed=np.zeros(places, whole_number),
            contacts=np.zeros(places, whole_number),
            slack=np.zeros(droppers, whole_number),
            found=np.zeros(droppers, whole_number),
            lacking=np.zeros(droppers),
        )
        self.times = np.zeros(K)
        self.contact = np.zeros((K, P, 4 + sections))
        self._strips = np.zeros((K, P, 5))

    def _new_trains(self, P: int, masses: int) -> Any:
        K, train = self.lanes, self._train
        return train.Trains(
            mass=np.zeros((K, P, masses)),
            air=np.zeros((K, P, masses)),
            inverse=np.zeros((K, P, masses, masses)),
            damping=np.zeros((K, P, masses, masses)),
            masses=np.ones((K, P), np.int64),
            steps=np.ones((K, P), np.int64),
            length=np.ones((K, P)),
            motion=np.zeros((K, P, 3, masses)),
            setting=np.zeros((K, P, train.SETTINGS)),
            strip=np.zeros((K, P, 4)),
            received=np.zeros((K, P, train.RECEIVED)),
            forces=np.zeros((K, P, train.FORCES)),
            work=np.zeros((2, masses)),
        )
