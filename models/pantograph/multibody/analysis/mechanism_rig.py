"""What describes a pantograph on a test rig: statics over the working height, modes, response of the strip."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from models.arrays import ComplexArray, FloatArray
from models.pantograph.multibody.analysis.cam_design import fit_force, strip_height_where
from models.pantograph.multibody.analysis.force_loop import moved_forces
from models.pantograph.multibody.analysis.linearisation import (
    Mode,
    apparent_mass,
    base_transmission,
    linearise,
    modes,
    receptance,
)
from models.pantograph.multibody.analysis.mechanism_freedom import (
    FreeMotion,
    degrees_of_freedom,
    freedom_warning,
    name_motions,
)
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at, equilibrium
from models.pantograph.multibody.analysis.posture import take_posture
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_definition import MechanismDefinition


@dataclass(frozen=True)
class Statics:
    """Statics over strip heights; rows that cannot be reached are left out.

    Attributes
    ----------
    height : ndarray, shape (h,)
        Of the strip above top of rail [m].
    balance : ndarray, shape (h,)
        Lifting value that the weights alone need [N or N.m].
    lift : ndarray, shape (h,)
        Lifting value that also carries the given contact force [N or N.m].
    contact_force : ndarray, shape (h,)
        Contact force with the definition's own lifting value [N].
    """

    height: FloatArray
    balance: FloatArray
    lift: FloatArray
    contact_force: FloatArray


@dataclass(frozen=True)
class Dynamics:
    """Small motions about an equilibrium.

    Attributes
    ----------
    height, contact_force, lift : float
        The equilibrium: strip height above top of rail [m], contact force [N], lifting value [N or N.m].
    modes : tuple of Mode
    motions : tuple of FreeMotion
        The modes in words.
    frequency : ndarray, shape (f,)
        [Hz]
    receptance, apparent_mass, base_transmission : ndarray, shape (f,)
        Of the contact point [m/N, kg, 1].
    """

    height: float
    contact_force: float
    lift: float
    modes: tuple[Mode, ...]
    motions: tuple[FreeMotion, ...]
    frequency: FloatArray
    receptance: ComplexArray
    apparent_mass: ComplexArray
    base_transmission: ComplexArray


@dataclass(frozen=True)
class CamCurves:
    """A cam over its range, arrays of shape (k,).

    Attributes
    ----------
    is_moment : bool
        Whether the lifting element gives a moment, and its place is an angle.
    place : ndarray
        [rad or m]
    height : ndarray
        Of the strip above top of rail, with nothing on it [m]; NaN where it has no equilibrium.
    for_weights, per_lift : ndarray
        What it gives without any lift set, and besides for each unit of that [N.m or N].
    """

    is_moment: bool
    place: FloatArray
    height: FloatArray
    for_weights: FloatArray
    per_lift: FloatArray


class Rig:
    """A pantograph on a rig, its base where it is in operation.

    Parameters
    ----------
    definition : MechanismDefinition

    Attributes
    ----------
    base_height : float
        Of the base's origin above top of rail [m].
    reference : ndarray, shape (13 n,)
        State with the strip at the reference height.

    Raises
    ------
    MechanismError
        If the mechanism cannot be assembled or balanced.
    """

    def __init__(self, definition: MechanismDefinition) -> None:
        self.definition = definition
        self.mechanism = Mechanism(definition)
        posture = take_posture(self.mechanism)
        self.reference = posture.reference
        self.base_height = posture.base_height

    @property
    def freedom(self) -> int:
        """Number of independent motions that the joints allow."""
        return degrees_of_freedom(self.mechanism, self.reference)

    def warning(self, contact_force: float) -> str:
        """Say so if there are motions too many, or some that grow, under a contact force [N]; empty if not."""
        return freedom_warning(self.mechanism, self.reference, contact_force)

    @property
    def lift_unit(self) -> str:
        """Unit of the lifting value."""
        return self.definition.lift_unit

    def statics(self, heights: FloatArray, contact_force: float = 157.5) -> Statics:
        """Return the statics at strip heights above top of rail [m], going up and down from the reference height."""
        up, down = self._outwards(heights)
        rows = sorted(self._sweep(up, contact_force) + self._sweep(down, contact_force))
        columns = np.array(rows, dtype=np.float64).reshape(-1, 4).T
        return Statics(columns[0], columns[1], columns[2], columns[3])

    def _sweep(self, heights: list[float], contact_force: float) -> list[tuple[float, float, float, float]]:
        """Solve height after height until one is out of reach."""
        rows = []
        y = self.reference
        for height in heights:
            above = height - self.base_height
            try:
                idle = equilibrium(self.mechanism, above, start=y)
                loaded = equilibrium(self.mechanism, above, contact_force=contact_force, start=idle.y)
                pressed = contact_force_at(self.mechanism, above, self.definition.lift, start=idle.y)
            except (MechanismError, np.linalg.LinAlgError):
                break
            rows.append((height, idle.lift, loaded.lift, pressed.inputs.force))
            y = idle.y
        return rows

    def cam_curves(self, points: int = 41) -> CamCurves | None:
        """Return the cam of the lifting element, None if it has none."""
        cam = self.mechanism.forces.cam
        if cam is None:
            return None
        places = np.linspace(*cam.per_lift.range, points)
        heights = np.full(points, np.nan)
        for k, place in enumerate(places.tolist()):
            with suppress(MechanismError, np.linalg.LinAlgError):
                heights[k] = self.base_height + strip_height_where(self.mechanism, self.reference, place)
        own = [0.0 if cam.for_weights is None else cam.for_weights.at(place) for place in places.tolist()]
        each = [cam.per_lift.at(place) for place in places.tolist()]
        return CamCurves(self.definition.lifts_by_moment, places, heights, np.array(own), np.array(each))

    def up_and_down(self, heights: FloatArray, speed: float) -> FloatArray:
        """Return strip heights that can be reached [m] and the forces there as the strip goes up and down [N].

        Parameters
        ----------
        heights : ndarray, shape (h,)
            Of the strip above top of rail [m].
        speed : float
            [m/s]

        Returns
        -------
        ndarray, shape (up to h, 3)
        """
        rows = []
        for group in self._outwards(heights):
            y = self.reference
            with suppress(MechanismError, np.linalg.LinAlgError):
                for height in group:
                    above, lift = height - self.base_height, self.definition.lift
                    found = moved_forces(self.mechanism, above, lift, speed, y)
                    rows.append((height, found.up, found.down))
                    y = found.y
        return np.array(sorted(rows), dtype=np.float64).reshape(-1, 3)

    def over_speed(self, speeds: FloatArray) -> FloatArray:
        """Return the static contact force at the reference height over the speed, shape (s, 2) [N].

        Parameters
        ----------
        speeds : ndarray, shape (s,)
            Against the air [m/s].

        Returns
        -------
        ndarray, shape (s, 2)
            With the knuckle leading, and trailing.

        Raises
        ------
        MechanismError
            If there is no equilibrium.
        """
        definition, mechanism = self.definition, self.mechanism
        above, has_air = mechanism.strip_height(self.reference), mechanism.forces.air.count > 0
        if any(definition.aerodynamic_uplift):
            fit_force(mechanism, self.reference)

        def force(uplift: float, speed: float) -> float:
            lift, besides = (definition.lift + uplift, 0.0) if definition.holds_force else (definition.lift, uplift)
            against = speed if has_air else 0.0
            found = contact_force_at(mechanism, above, lift, start=self.reference, uplift=besides, against=against)
            return found.inputs.force

        known: dict[tuple[float, float], float] = {}
        rows = np.empty((len(speeds), 2))
        for i, speed in enumerate(speeds.tolist()):
            for k, coefficient in enumerate(definition.aerodynamic_uplift):
                what = coefficient * speed * speed, speed if has_air else 0.0
                if what not in known:
                    known[what] = force(*what)
                rows[i, k] = known[what]
        return rows

    def _outwards(self, heights: FloatArray) -> tuple[list[float], list[float]]:
        """Return heights from the reference height up, and from there down."""
        reference = self.definition.reference_height
        up = sorted(h for h in heights.tolist() if h >= reference)
        return up, sorted((h for h in heights.tolist() if h < reference), reverse=True)

    def dynamics(
        self, height: float, frequencies: FloatArray, contact_force: float = 157.5, lateral: float = 0.0
    ) -> Dynamics:
        """Return modes and responses about an equilibrium.

        Parameters
        ----------
        height : float
            Of the strip's middle above top of rail [m].
        frequencies : ndarray, shape (f,)
            [Hz], greater than 0.
        contact_force : float
            Constant force on the strip [N].
        lateral : float
            y of its point of application, which is also where the response is taken [m].
        """
        found = equilibrium(
            self.mechanism,
            height - self.base_height,
            contact_force=contact_force,
            lateral=lateral,
            start=self.reference,
        )
        try:
            model = linearise(self.mechanism, found.y, found.inputs)
            free = modes(self.mechanism, model)
            return Dynamics(
                height,
                contact_force,
                found.lift,
                free,
                name_motions(self.mechanism, free),
                np.asarray(frequencies, dtype=np.float64),
                receptance(model, frequencies),
                apparent_mass(model, frequencies),
                base_transmission(self.mechanism, model, frequencies),
            )
        except np.linalg.LinAlgError as error:
            raise MechanismError(
                f"{self.definition.name}: its small motions about a strip height of {height:g} m have no solution "
                f"({error}); look for a part that nothing holds, or for joints that repeat each other"
            ) from error
