"""A lumped pantograph's macro step in compiled kernels."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import FloatArray
from models.numerics.extrapolation import MAX_ORDER, ForceExtrapolation
from models.numerics.kernel_cache import kernels_if_wanted
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_model import LumpedModel

if TYPE_CHECKING:  # an FMU carries what is imported, and this is never imported by its name
    from models.pantograph.lumped import lumped_kernels as _  # noqa: F401

#: Read now: an FMU's folder may be gone when a second instance asks for the kernels.
_SOURCE = Path(__file__).with_name("lumped_kernels.py").read_bytes()


class CompiledStep:
    """Macro steps of one pantograph in compiled kernels.

    Parameters
    ----------
    model : LumpedModel
    kernels : module
        `models.pantograph.lumped.lumped_kernels`, compiled.
    """

    def __init__(self, model: LumpedModel, kernels: ModuleType) -> None:
        self._model = model
        self._constants = np.array(kernels.Constants(**_constants(model.definition, model.balance)))
        self._known = np.zeros(kernels.WIDTH)
        self._following: dict[float, FloatArray] = {}
        self._step = kernels.step
        self.rehearse()

    def rehearse(self) -> None:
        """Take a trial step, so that the first real one finds everything compiled: a paced run must not wait for it."""
        n, h = self._model.size, self._model.definition.time_step
        when, nothing = (0.0, 0.0, h), (0.0, 0.0, 0.0)
        way = (0.0, 0.0, 0.0, 0.0)
        self.step(np.zeros(4 * n), when, 1, (0.0, 0.0), way, np.zeros(2), nothing, np.zeros(n), np.zeros(12 + 3 * n))

    def take(self, force: ForceExtrapolation) -> None:
        """Go on from what is known of the contact force."""
        self._known[:] = [force.known, *force.times, *force.values]

    def give(self, force: ForceExtrapolation) -> None:
        """Say what is known of the contact force."""
        known, *rest = self._known.tolist()
        force.known, force.times, force.values = int(known), rest[: MAX_ORDER + 1], rest[MAX_ORDER + 1 :]

    def step(
        self,
        values: FloatArray,
        when: tuple[float, float, float],
        count: int,
        contact: tuple[float, float],
        way: tuple[float, float, float, float],
        base: FloatArray,
        hung: tuple[float, float, float],
        own: FloatArray,
        outputs: FloatArray,
    ) -> float:
        """Make a macro step; return the reference that the lowest spring hangs on, if it follows the height [m].

        Parameters
        ----------
        values : ndarray, shape (4 n,)
            Motion, replaced, and work space; see `LumpedModel.transition`.
        when : (float, float, float)
            When the run began, when the step begins, how long it is [s].
        count : int
            Equal steps that it is divided into.
        contact : (float, float)
            Contact force [N] and its place along the track [m].
        way : (float, float, float, float)
            Place at the beginning of the step, speed within it, place and speed at its end [m, m/s].
        base : ndarray, shape (2,)
            Height and velocity of the roof [m, m/s].
        hung : (float, float, float)
            That reference, the height of the roof at the end of the step before, and the rate given from outside
            [m, m, m/s].
        own : ndarray, shape (n + 9 m,)
            Loads that do not change in the step [N], then the table of stops and friction; see `held_forces`.
        outputs : ndarray, shape (12 + 3 n,)
            Result.
        """
        h = when[2] / count
        transition, following = self._model.transition(h), self._follower(h)
        known, constants = self._known, self._constants
        return self._step(
            known, values, transition, constants, *when, count, *contact, way, base, *hung, following, own, outputs
        )

    def _follower(self, h: float) -> FloatArray:
        """Return stiffness and coefficients of the reference in a step [s], shape (5,); stiffness 0: it is fixed."""
        found = self._following.get(h)
        if found is None:
            found = self._following[h] = np.zeros(5)
            if self._model.follows:
                found[:] = self._model.definition.stage[0].stiffness, *self._model.following(h)[1:]
        return found


def compiled_step(model: LumpedModel) -> CompiledStep | None:
    """Return compiled steps of a pantograph, None where there are none.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """
    kernels = kernels_if_wanted("lumped", _SOURCE)
    return None if kernels is None else CompiledStep(model, kernels)


def _constants(definition: LumpedDefinition, balance: float) -> dict[str, float]:
    lowest = definition.stage[0]
    return {
        "order": definition.extrapolation_order,
        "static_force": definition.static_force,
        "balance": balance,
        "raise_start": definition.raise_start,
        "raise_duration": definition.raise_duration,
        "stiffness": lowest.stiffness,
        "damping": lowest.damping,
        "reference_height": definition.reference_height,
    }
