"""What was found last of mechanisms in a process: the runs of a sweep, or the pantographs of a train, need the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, Generic, TypeVar

from models.arrays import FloatArray
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_definition import MechanismDefinition

T = TypeVar("T")
#: What says how a pantograph runs, and from where it starts: of no account for what it is. All else counts.
OF_A_RUN: Final[dict[str, Any]] = {
    "speed": 0.0,
    "start_position": 0.0,
    "speed_profile": None,
    "use_train": 0,
    "reference_height": 0.0,
    "start_height": None,
    "raise_start": 0.0,
    "raise_duration": 0.0,
    "aerodynamic_uplift": (0.0, 0.0),
    "knuckle": "leading",
    "direction": 1,
    "extrapolation_order": 0,
    "monitor_energy": 0,
    "time_step": 0.0,
    "tolerance": 0.0,
}


class LastFound(Generic[T]):
    """Results that follow from a mechanism and a state of it, those used last.

    Parameters
    ----------
    most : int
        How many are kept.
    """

    def __init__(self, most: int = 8) -> None:
        self.most = most
        self._kept: dict[tuple[MechanismDefinition, bytes, bytes], T] = {}

    def of(self, mechanism: Mechanism, standing: FloatArray, find: Callable[[], T]) -> T:
        """Return what ``find`` returns for a mechanism in a state, shape (13 n,), unless it is known.

        It must be the same for all mechanisms of a definition whose springs have the same free lengths, and nobody may
        change it.
        """
        definition = replace(mechanism.definition, **OF_A_RUN)
        key = definition, standing.tobytes(), mechanism.forces.lines.free_length.tobytes()
        try:  # not asked before: another thread, of a host with one for each FMU, may take it meanwhile
            found = self._kept.pop(key)
        except KeyError:
            found = find()
        self._kept[key] = found
        for oldest in list(self._kept)[: -self.most]:
            self._kept.pop(oldest, None)
        return found

    def clear(self) -> None:
        """Forget all."""
        self._kept.clear()
