"""Signals between communication points: what an FMU wraps."""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray, Snapshot
from models.signals.signal_definition import SignalDefinition

#: Times this near to an end of the table are that end [s]: hosts sum up time.
_NEAR = 1e-9


class SignalPart:
    """Signals of a table at communication points.

    Parameters
    ----------
    definition : SignalDefinition

    Attributes
    ----------
    time : float
        [s]
    outputs : ndarray, shape (m,)
        The definition's outputs, as they are now.
    told : list of str
        What the user should know of the time so far; whoever fetches it empties it.
    """

    def __init__(self, definition: SignalDefinition) -> None:
        self.definition = definition
        self.time = 0.0
        self.outputs = np.zeros(len(definition.outputs))
        self.told: list[str] = []
        self._has_told = [False, False]
        self._columns = {
            kind: [o.column for o in definition.outputs if o.kind == kind] for kind in ("value", "rate", "integral")
        }
        self._places = {kind: [i for i, o in enumerate(definition.outputs) if o.kind == kind] for kind in self._columns}

    def initialise(self, time: float) -> None:
        """Begin at a time [s]."""
        self.time = time
        self._has_told = [False, False]
        self._show()

    def move(self, time: float) -> None:
        """Go on to a time [s]."""
        self.time = time
        self._show()

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        return {"time": np.array([self.time]), "told": np.array(self._has_told)}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.time = float(snapshot["time"][0])
        self._has_told = [bool(told) for told in snapshot["told"]]
        self._show()

    def _show(self) -> None:
        definition = self.definition
        time = self.time - definition.time_shift
        begin, end = definition.table.span
        time = begin if abs(time - begin) < _NEAR else end if abs(time - end) < _NEAR else time
        found = definition.table.at(time)
        made: dict[str, FloatArray] = {
            "value": definition.gain * found.value + definition.offset,
            "rate": definition.gain * found.rate,
            "integral": definition.gain * found.integral + definition.offset * (time - begin),
        }
        for kind, places in self._places.items():
            if places:
                self.outputs[places] = made[kind][self._columns[kind]]
        if not definition.repeats and not begin <= time <= end:
            self._tell(time < begin)

    def _tell(self, is_early: bool) -> None:
        if self._has_told[not is_early]:
            return
        self._has_told[not is_early] = True
        shift, (begin, end) = self.definition.time_shift, self.definition.table.span
        edge = begin + shift if is_early else end + shift
        does, holds = ("begins", "its first values hold before") if is_early else ("ends", "its last values hold on")
        self.told.append(
            f"{self.definition.name}: the table {does} at t = {edge:.6g} s and {holds} (t = {self.time:.6g} s)"
        )
