"""Where a roof that moves sideways and rolls takes the strip of a lumped pantograph: kinematics alone."""

from __future__ import annotations

import math

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.operation import NO_SWAY, Drive, OperationError


class SwayingStrip:
    """The roof's lateral motion and roll as they move the strip's ends.

    The masses move up and down in the roof's axes: the strip, at y = s and h above the base, is at
    y_0 + s cos(phi) - h sin(phi) and at s sin(phi) + h cos(phi) above the base.

    Parameters
    ----------
    definition : LumpedDefinition

    Attributes
    ----------
    is_still : bool
        Whether the roof has not swayed yet.
    """

    def __init__(self, definition: LumpedDefinition) -> None:
        self._definition = definition
        half = 0.5 * definition.strip_length
        self._along = np.array([definition.strip_offset + half, definition.strip_offset - half])
        # Lateral position and velocity, roll and its rate at the end of the step; height and velocity of the roof.
        self._now = np.zeros(6)
        self.is_still = True

    def receive(self, drive: Drive, base: FloatArray, step: float) -> None:
        """Continue what was received for the beginning of a step [s] to its end.

        Parameters
        ----------
        base : ndarray, shape (2,)
            Height and velocity of the roof, received at the same time [m, m/s].

        Raises
        ------
        OperationError
            If the roof rolls, but nothing says how high it is; if it yaws.
        """
        if drive.sway == NO_SWAY:
            self._now[:4] = 0.0
            return
        self.is_still = False
        y, vy, roll, roll_rate, yaw, yaw_rate = drive.sway
        if yaw != 0.0 or yaw_rate != 0.0:
            raise OperationError(f"{self._definition.name}: a lumped pantograph has no yaw")
        if self._definition.base_height is None and (roll != 0.0 or roll_rate != 0.0):
            raise OperationError(
                f"{self._definition.name}: base.roll turns the strip about the base, whose height nothing says: write "
                "base_height [m above rail] into the definition, or leave base.roll and base.roll_rate unconnected"
            )
        height, velocity = base.tolist()
        self._now[:] = y + step * vy, vy, roll + step * roll_rate, roll_rate, height + step * velocity, velocity

    def place(self, strip: FloatArray) -> None:
        """Turn and shift a strip that is level, shape (2, 2, 3): end A, B; position, velocity; x, y, z."""
        if self.is_still:
            return
        y, vy, roll, rate, height, velocity = self._now.tolist()
        if not (y or vy or roll or rate):
            strip[:, 0, 1], strip[:, 1, 1] = self._along, 0.0
            return
        foot = height + (self._definition.base_height or 0.0)
        above, rise = strip[0, 0, 2] - foot, strip[0, 1, 2] - velocity
        sine, cosine = math.sin(roll), math.cos(roll)
        side, up = self._along * cosine - above * sine, self._along * sine + above * cosine
        strip[:, 0, 1], strip[:, 0, 2] = y + side, foot + up
        strip[:, 1, 1], strip[:, 1, 2] = vy - rate * up - rise * sine, velocity + rate * side + rise * cosine

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        return {"sway": self._now.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self._now[:] = snapshot["sway"]
        self.is_still = self.is_still and not self._now.any()
