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
        self._constants = np.array(kernels.Constants(**_constants(model.definition)))
        self._known = np.zeros(kernels.WIDTH)
        self._step = kernels.step
        self.rehearse()

    def rehearse(self) -> None:
        """Take a trial step, so that the first real one finds everything compiled: a paced run must not wait for it."""
        n, h = self._model.size, self._model.definition.time_step
        self.step(np.zeros(4 * n), (0.0, 0.0, h), 1, (0.0, 0.0), np.zeros(2), np.zeros(12 + 3 * n))

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
        base: FloatArray,
        outputs: FloatArray,
    ) -> None:
        """Make a macro step.

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
        base : ndarray, shape (2,)
            Height and velocity of the roof [m, m/s].
        outputs : ndarray, shape (12 + 3 n,)
            Result.
        """
        transition = self._model.transition(when[2] / count)
        self._step(self._known, values, transition, self._constants, *when, count, *contact, base, outputs)


def compiled_step(model: LumpedModel) -> CompiledStep | None:
    """Return compiled steps of a pantograph, None where there are none.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """
    kernels = kernels_if_wanted("lumped", _SOURCE)
    return None if kernels is None else CompiledStep(model, kernels)


def _constants(definition: LumpedDefinition) -> dict[str, float]:
    lowest = definition.stage[0]
    return {
        "order": definition.extrapolation_order,
        "static_force": definition.static_force,
        "raise_start": definition.raise_start,
        "raise_duration": definition.raise_duration,
        "stiffness": lowest.stiffness,
        "damping": lowest.damping,
        "start_position": definition.start_position,
        "speed": definition.speed,
        "reference_height": definition.reference_height,
    }
