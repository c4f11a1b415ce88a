"""What a step of a mechanism leaves for the next one: the equations of motion at its end, and rates within it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.pantograph.multibody.base_motion import Sway
from models.pantograph.multibody.mechanism import Inputs
from models.pantograph.multibody.mechanism_integrator import History


class LastEvaluation(NamedTuple):
    """The accelerations at the end of a step, their response to other inputs, and the inputs that acted."""

    acceleration: FloatArray
    response: FloatArray
    inputs: Inputs

    def snapshot(self) -> Snapshot:
        """Return all of it."""
        inputs = np.array(flat_inputs(self.inputs))
        return {"last.acceleration": self.acceleration, "last.response": self.response, "last.inputs": inputs}

    @classmethod
    def restored(cls, snapshot: Snapshot) -> LastEvaluation | None:
        """Return what a snapshot holds."""
        if "last.inputs" not in snapshot:
            return None
        inputs = _unflattened(snapshot["last.inputs"].tolist())
        acceleration, response = (snapshot[f"last.{name}"].astype(np.float64) for name in ("acceleration", "response"))
        return cls(acceleration, response, inputs)


def beyond_response(inputs: Inputs) -> tuple[object, ...]:
    """Return what of the inputs must be as it was for the response to lead from some to others."""
    return (*inputs.base[:2], inputs.lift, *inputs[4:])


def flat_inputs(inputs: Inputs) -> list[float]:
    """Return the inputs as 21 numbers, with a 0 before what there is none of and a 1 before what there is."""
    sway = [0.0] * 10 if inputs.sway is None else [1.0, *(value for motion in inputs.sway for value in motion)]
    driven = [0.0, 0.0] if inputs.driven_lift is None else [1.0, inputs.driven_lift]
    return [*inputs.base, *inputs[1:5], inputs.pull, inputs.against, *driven, *sway]


def _unflattened(values: list[float]) -> Inputs:
    """Return the inputs that `flat_inputs` was given."""
    z, vz, az, lift, force, lateral, uplift, pull, against, is_driven, driven, sways, *moving = values
    y, roll, yaw = ((moving[k], moving[k + 1], moving[k + 2]) for k in (0, 3, 6))
    sway = Sway(y, roll, yaw) if sways else None
    return Inputs((z, vz, az), lift, force, lateral, uplift, sway, pull, against, driven if is_driven else None)


def history_snapshot(history: History) -> Snapshot:
    """Return the rates of the step before as arrays."""
    step = np.array([history.step])
    return {"history.step": step, "history.middle": history.middle, "history.begin": history.begin}


def restored_history(snapshot: Snapshot) -> History | None:
    """Return what a snapshot holds of them."""
    if "history.step" not in snapshot:
        return None
    middle, begin = (snapshot[f"history.{name}"].astype(np.float64) for name in ("middle", "begin"))
    return History(float(snapshot["history.step"][0]), middle, begin)
