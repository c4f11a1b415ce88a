"""A pantograph in the reduced form: its model as numbers, and its motion between communication points."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.numerics.cubic_curve import CubicCurve
from models.numerics.kernel_cache import kernels_if_wanted
from models.pantograph.multibody.elements.rotations import cross
from models.pantograph.multibody.last_found import LastFound
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_assembly import project
from models.pantograph.multibody.mechanism_integrator import VELOCITY_SCALE
from models.pantograph.multibody.reduced import reduced_equations
from models.pantograph.multibody.reduced.closed_arm import ArmFinder, ArmTables, tabulate, turn_between
from models.pantograph.multibody.reduced.head_chain import HeadChain, HeadRows
from models.pantograph.multibody.reduced.quintic_table import QuinticTable
from models.pantograph.multibody.reduced.reduction import NotReducibleError, reduction_of

if TYPE_CHECKING:  # an FMU carries what is imported, and this is never imported by its name
    from models.pantograph.multibody.reduced import reduced_kernels as _  # noqa: F401

#: Read now: an FMU's folder may be gone when a second instance asks for the kernels.
_SOURCE: Final = b"\n".join(
    Path(__file__).with_name(f"{name}.py").read_bytes() for name in ("reduced_equations", "reduced_kernels")
)
#: Why a step could not be made.
_REASONS: Final = {
    reduced_equations.TOO_SMALL: "the error control wants steps too small for the reduced form",
    reduced_equations.BEYOND: "the arm is beyond the tables of the reduced form",
}
_NO_CURVE: Final = np.zeros((0, 5))
#: Tabulating an arm takes most of a pantograph's start.
_tables: Final = LastFound[ArmTables]()


class ReducedModel:
    """A mechanism in reduced coordinates, which are 0 in a given state.

    Parameters
    ----------
    mechanism : Mechanism
        Its springs settled, its cam fitted.
    standing : ndarray, shape (13 n,)
        A closed state at rest.

    Attributes
    ----------
    size : int
        Number of coordinates: theta, roll, displacements. Without a hinge the roll stays 0.

    Raises
    ------
    NotReducibleError
        If the mechanism does not allow it; says why.
    """

    def __init__(self, mechanism: Mechanism, standing: FloatArray) -> None:
        self.mechanism, self._standing = mechanism, standing.copy()
        reduction = reduction_of(mechanism, standing)
        self._finder = ArmFinder(reduction)
        self._head = HeadChain(mechanism, standing, reduction)
        self._rows: HeadRows = self._head.rows()
        self._arm = _tables.of(mechanism, standing, lambda: tabulate(reduction, self._finder))
        self._reduction = reduction
        self.size = 2 + self._rows.displacements
        definition = mechanism.definition
        half = 0.5 * definition.strip_length
        weights = [self._arm.reach, half, *[1.0] * self._rows.displacements]
        weights += [w / VELOCITY_SCALE for w in weights]
        self.settings = (definition.tolerance, definition.time_step, weights)
        order = [*reduction.arm.names[reduction.arm.driven :], *(link.body for link in reduction.head)]
        self.order = [order.index(name) for name in mechanism.names[mechanism.driven :]]

    @property
    def rolls(self) -> bool:
        """Whether the head has a hinge."""
        return self._rows.rolls

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest theta of the tables [rad or m]."""
        return self._arm.functions.start, self._arm.functions.end

    @property
    def described(self) -> str:
        """Say of what coordinates there are."""
        names = ["the arm", *(["the roll of the head"] if self._rows.rolls else [])]
        slides = self._rows.displacements
        names += [] if not slides else ["one displacement" if slides == 1 else f"{slides} displacements"]
        last = names.pop()
        listed = f"{', '.join(names)} and {last}" if names else last
        return f"reduced form of the equations of motion, in coordinates of {listed}"

    def numbers(self, table: Any, rows: Any, curve: Any) -> tuple[Any, Any]:
        """Return ``model`` and ``outline`` of `reduced_equations`.

        Parameters
        ----------
        table, rows, curve : callable
            Make of a `QuinticTable`, of rows and of a curve's rows what the equations are to work on.
        """
        r = self._rows
        single = np.array([self.mechanism.definition.gravity, 0.0 if r.rolls else 1.0, *r.axis])
        model = (
            table(self._arm.functions),
            rows(single),
            rows(r.bodies),
            rows(r.lines),
            rows(r.slides),
            rows(r.turns),
            rows(self._arm.rows),
            rows(r.strip),
            self._curves(curve),
        )
        return model, table(self._arm.outline)

    def _curves(self, curve: Any) -> Any:
        forces = self.mechanism.forces
        cam, own, per_lift = forces.cam, _NO_CURVE, _NO_CURVE
        if cam is not None:
            own, per_lift = _rows_of(cam.for_weights), _rows_of(cam.per_lift)
        adds = forces.cam is None and forces.per_force is None and forces.lift_place is not None
        return curve(own), curve(per_lift), curve(_rows_of(forces.per_force)), float(adds)

    def cartesian(self, y: FloatArray, base: FloatArray) -> FloatArray:
        """Return the state of all bodies, shape (13 n,), for coordinates and rates, shape (2 size,).

        Parameters
        ----------
        base : ndarray, shape (2,)
            Height and velocity of the base [m, m/s].
        """
        theta = float(y[0])
        return project(self.mechanism, self._state(y, base, self._finder.at(theta, self._posture(theta)).y))

    def posture(self, y: FloatArray, base: FloatArray) -> FloatArray:
        """Return nearly the same at rest, as the tables have it, in much less time."""
        still = y.copy()
        still[self.size :] = 0.0
        return self._state(still, base, self._posture(float(y[0])))

    def _posture(self, theta: float) -> FloatArray:
        """Return the arm's state at rest, nearly."""
        places = self._arm.postures.at(theta)
        return np.concatenate([places, np.zeros(6 * self._finder.arm.count)])

    def _state(self, y: FloatArray, base: FloatArray, arm_state: FloatArray) -> FloatArray:
        """Return the state of all bodies for that of the arm with theta' = 1."""
        n, mechanism, arm = self.size, self.mechanism, self._finder.arm
        roll, speed, roll_rate = y[1], y[n], y[n + 1]
        state = self._standing.copy()
        s, a = mechanism.split(state), arm.split(arm_state)
        for k, name in enumerate(arm.names):
            i = mechanism.numbers[name]
            s.r[i], s.p[i], s.v[i], s.w[i] = a.r[k], a.p[k], speed * a.v[k], speed * a.w[k]
        carrier = mechanism.numbers[self._reduction.carrier]
        start = mechanism.split(self._standing)
        turn = turn_between(start.p[carrier], s.p[carrier])
        frames = mechanism.kinematics(state).frames[:, :3]
        spin = frames[carrier] @ s.w[carrier]
        pitched = frames[carrier] @ self._head.frames[carrier].T
        rolled = _times(turn, np.array([np.cos(0.5 * roll), *(np.sin(0.5 * roll) * self._rows.axis)]))
        rows = self._rows.bodies.tolist()
        coordinates, sine, cosine = y.tolist(), float(np.sin(roll)), float(np.cos(roll))
        for link, row in zip(self._reduction.head, rows, strict=True):
            i = mechanism.numbers[link.body]
            motion = reduced_equations.motion_of(row, coordinates, n, sine, cosine)
            lever = pitched @ np.array(motion[:3])
            s.r[i] = s.r[carrier] + lever
            s.v[i] = s.v[carrier] + cross(spin, lever) + pitched @ np.array(motion[9:12])
            rolls = self._head.places[link.body].rolls
            s.p[i] = _times(rolled if rolls else turn, start.p[i])
            turning = spin + roll_rate * (pitched @ self._rows.axis) if rolls else spin
            s.w[i] = mechanism.kinematics(state).frames[i, :3].T @ turning
        s.r[:, 2] += base[0]
        s.v[:, 2] += base[1]
        return state


def reduced_if_possible(mechanism: Mechanism, standing: FloatArray) -> tuple[ReducedModel | None, str]:
    """Return the reduced model of a mechanism, None if it stays in the general form; and which it is, in words.

    Parameters
    ----------
    mechanism : Mechanism
        Its springs settled, its cam fitted.
    standing : ndarray, shape (13 n,)
        A closed state at rest.
    """
    try:
        model = ReducedModel(mechanism, standing)
    except NotReducibleError as error:
        return None, f"general form of the equations of motion: {error}"
    return model, model.described


class ReducedMotion:
    """The motion of a pantograph in reduced coordinates, with compiled kernels where there are any.

    Parameters
    ----------
    model : ReducedModel

    Attributes
    ----------
    memory : tuple of lists, or of arrays with kernels
        State and what the next step continues; see `reduced_equations`.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """

    def __init__(self, model: ReducedModel) -> None:
        self.model = model
        kernels = kernels_if_wanted("reduced", _SOURCE)
        self._equations: Any = reduced_equations if kernels is None else kernels
        self._plain = kernels is None
        n = model.size
        self.memory: Any = tuple(
            self._rows(np.zeros(k)) for k in (2 * n, n, 3 * n, 2 * n, 2 * n, reduced_equations.SINGLE)
        )
        self._settings = (*model.settings[:2], self._rows(np.array(model.settings[2])))
        self.refresh()

    def _rows(self, values: FloatArray) -> Any:
        return values.tolist() if self._plain else np.ascontiguousarray(values)

    def refresh(self) -> None:
        """Take the curves of the lifting element again: one was fitted."""
        self._fitted = self.model.mechanism.forces.per_force
        self._numbers, self._outline = self.model.numbers(self._table, self._rows, self._rows)

    def _table(self, table: QuinticTable) -> Any:
        count = len(table.cells)
        return table.start, count / (table.end - table.start), count, list(table.cells) if self._plain else table.cells

    @property
    def base_acceleration(self) -> float:
        """Acceleration of the base at last [m/s2]."""
        return float(self.memory[-1][reduced_equations.BASE_A])

    @property
    def lift(self) -> tuple[float, float]:
        """What was set of the lifting element last, and the force besides."""
        single = self.memory[-1]
        return float(single[reduced_equations.LIFT]), float(single[reduced_equations.UPLIFT])

    def lift_value(self) -> float:
        """Return the force or moment of the lifting element [N or N.m]."""
        lift, uplift = self.lift
        place = self._equations.look_up(self._numbers[0], self.memory[0][0])[reduced_equations.PLACE]
        return float(self._equations.lift_value(self._numbers[8], place, lift, uplift))

    def evaluate(
        self, y: FloatArray, acting: tuple[float, float, float, float, float]
    ) -> tuple[FloatArray, FloatArray]:
        """Return accelerations (n,) and their response (3 n,) in a state; see `reduced_equations.evaluate`.

        By beginning there under inputs that are held: the equations themselves are compiled for other kernels alone.
        """
        force, lateral, base, lift, uplift = acting
        held = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, force, 0.0, 0.0, 0.0, lateral, 0.0, 0.0, 0.0, 0.0, 0.5 * base, 0.0]
        memory = tuple(part.copy() for part in self.memory)
        memory[0][:] = self._rows(y)
        given = self._inputs([*held, lift, lift, 0.0, 0.0, uplift, 0.0])
        self._equations.begin(memory, given, self._numbers, self._settings)
        return np.array(memory[1]), np.array(memory[2])

    def begin(self, given: list[float]) -> None:
        """Begin at rest where all coordinates are 0; ``given`` as in ``step``."""
        for part in self.memory:
            part[:] = self._rows(np.zeros(len(part)))
        self._equations.begin(self.memory, self._inputs(given), self._numbers, self._settings)
        if not self._plain:
            self._rehearse(given)

    def _rehearse(self, given: list[float]) -> None:
        """Take a trial step, so that the first real one finds everything compiled: a paced run must not wait for it."""
        memory, self.memory = self.memory, tuple(part.copy() for part in self.memory)
        self.step(given, self._settings[1])
        self.place_strip((0.0, 0.0, 0.0, 0.0), np.zeros((2, 2, 3)))
        self.bodies((0.0, 0.0, 0.0))
        self.lift_value()
        self.is_free(0.0, 0.0)
        self.memory = memory

    def _inputs(self, given: list[float]) -> Any:
        return given if self._plain else np.array(given, dtype=np.float64)

    def step(self, given: list[float], duration: float) -> str:
        """Advance by ``duration`` [s]; say so if nothing has changed because the general form has to take over.

        Parameters
        ----------
        given : list of 23 floats
            Time, time of the start [s]; of the contact force the number of values known, three times, three values,
            order; of its place across the track value, rate, time; of the base the cubic's coefficients, constant one
            first; of the lifting element the value at first and in the end, start and duration of the raise, the force
            besides, and whether that is added to what is set.
        """
        if self._fitted is not self.model.mechanism.forces.per_force:
            self.refresh()
        done = self._equations.step(self.memory, self._inputs(given), duration, self._numbers, self._settings)
        return _REASONS[done] if done else ""

    def is_free(self, lowest: float, highest: float) -> bool:
        """Return whether no stop is reached, and the lifting element is between two places [rad or m]."""
        return bool(self._equations.is_free(self.memory[0], self._numbers, lowest, highest))

    def snapshot(self) -> Snapshot:
        """Return the whole state, bit for bit."""
        return {"reduced": np.concatenate(self.memory)}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        ends = np.cumsum([len(part) for part in self.memory])
        for part, values in zip(self.memory, np.split(snapshot["reduced"], ends[:-1]), strict=True):
            part[:] = self._rows(values.astype(np.float64))

    def place_strip(self, moved: tuple[float, float, float, float], strip: FloatArray) -> None:
        """Write the ends of the strip, shape (2, 2, 3); see `reduced_equations.place_strip`."""
        flat = strip.reshape(12)
        ends: Any = [0.0] * 12 if self._plain else flat
        self._equations.place_strip(self.memory, self._numbers, moved, ends)
        if self._plain:
            flat[:] = ends

    def bodies(self, base: tuple[float, float, float]) -> FloatArray:
        """Return height, velocity and acceleration of the bodies, shape (bodies, 3), for those of the base."""
        order = self.model.order
        found = self._rows(np.zeros(3 * len(order)))
        self._equations.place_bodies(self.memory, self._numbers, self._outline, base, found)
        return np.array(found).reshape(-1, 3)[order]

    def cartesian(self, base: FloatArray) -> FloatArray:
        """Return the state of all bodies, shape (13 n,), for height and velocity of the base."""
        return self.model.cartesian(np.array(self.memory[0]), base)

    def posture(self, base: FloatArray) -> FloatArray:
        """Return nearly the same at rest, for those who only look where bodies are."""
        return self.model.posture(np.array(self.memory[0]), base)


def _rows_of(curve: CubicCurve | None) -> FloatArray:
    return _NO_CURVE if curve is None else curve.rows


def _times(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the product of Euler parameters: first b, then a."""
    axial = a[0] * b[1:] + b[0] * a[1:] + cross(a[1:], b[1:])
    return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], axial])
