"""The values of an FMU's variables in one array, by value reference: found, set, checked, read from the part."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from fmus.slave.ports import Port, Table
from fmus.slave.slave_failures import AdapterError
from models.arrays import FloatArray

#: Beyond every value reference: no value is out of date.
_NOTHING = sys.maxsize


class VariableValues:
    """The values of one instance's variables.

    Attributes
    ----------
    table : Table
    values : ndarray, shape (len(table),)
        By value reference. Parts of it are shared as views, so write into it and never replace it.
    parameters, inputs : ndarray
        Views of ``values``.
    stale_from : int
        The lowest value reference whose value is out of date; greater than all of them if none is.
    """

    def __init__(self, table: Table) -> None:
        self.table = table
        self.values = table.start_values()
        self.parameters, self.inputs = self.values[table.parameters], self.values[table.inputs]
        self.stale_from = _NOTHING
        self._starts = self.parameters.copy()
        self._outputs = self.values[table.outputs]
        self._first_input, self._first_output = table.inputs.start, table.outputs.start
        self._first_asked, self._first_local = table.asked.start, table.local.start
        self._references = list(range(len(table)))
        self._output_places = self._places(table.outputs, table.ports.outputs)
        self._asked_places = self._places(table.asked, table.ports.asked)
        self._local_places = self._places(table.local, table.ports.local)
        self._calculated_places = self._places(table.calculated, table.ports.calculated)

    # What the host asks for and sets.

    def find(self, references: list[int]) -> tuple[slice | list[int], int, int]:
        """Return where variables lie, the lowest and the highest reference.

        A slice, which costs least, if they follow one another, as what hosts ask for again and again mostly does.

        Raises
        ------
        AdapterError
            If there is no such variable.
        """
        first, last = references[0], references[-1]
        run = slice(first, last + 1)
        if self._references[run] == references:
            return run, first, last
        highest = max(references)
        if highest >= len(self._references):
            raise AdapterError(f"the FMU has no variable with value reference {highest}")
        return references, min(references), highest

    def set(self, references: list[int], values: Sequence[float], are_parameters_fixed: bool) -> None:
        """Set inputs and parameters.

        Raises
        ------
        AdapterError
            If a variable cannot be set, or is a parameter that can no longer change.
        """
        places, lowest, highest = self.find(references)
        if self._first_input <= lowest and highest < self._first_output:
            self.values[places] = values
            return
        for reference, value in zip(references, values, strict=True):
            self._set_one(reference, value, are_parameters_fixed)

    def _set_one(self, reference: int, value: float, are_parameters_fixed: bool) -> None:
        variable = self.table.variables[reference]
        if variable.causality not in ("parameter", "input"):
            raise AdapterError(f"{variable.signal.name} is computed by the FMU and cannot be set")
        if variable.causality == "parameter" and are_parameters_fixed and value != self.values[reference]:
            raise AdapterError(
                f"parameter {variable.signal.name} cannot change from {self.values[reference]:.9g} "
                f"to {value:.9g} after initialization: reset the FMU, or make a new instance"
            )
        self.values[reference] = value

    def known(self, time: float) -> bytes:
        """Return what an initialisation depends on: parameters, inputs and the time."""
        return self.values[: self._first_output].tobytes() + np.float64(time).tobytes()

    def changed_parameters(self, parameters: FloatArray) -> dict[str, float]:
        """Return those parameters, by name, that differ from their start values."""
        return {
            self.table.name(i): float(parameters[i])
            for i in range(len(parameters))
            if parameters[i] != self._starts[i]  # NaN differs too, and is refused by the definition
        }

    def checked_inputs(self, time: float) -> FloatArray:
        """Return a copy of the inputs, since a part may keep it to extrapolate from.

        Raises
        ------
        AdapterError
            If one is not finite.
        """
        inputs = self.inputs.copy()
        if not _surely_finite(inputs):
            self._check_finite(self.table.inputs, time, "input", "the part that it comes from has failed")
        return inputs

    # What the part computes.

    def fit(self, part: Any) -> None:
        """Take the shapes of a built part's arrays, so that these can be copied as they are.

        Raises
        ------
        AdapterError
            If the part has more values, or fewer, than the FMU has variables for.
        """
        for places in (self._output_places, self._asked_places, self._local_places, self._calculated_places):
            for i, (place, port) in enumerate(places):
                places[i] = _reshaped(place, port, np.shape(port.read(part))), port

    def read_all(self, part: Any) -> None:
        """Read everything that the part computes, what it computed as it was built too."""
        for places in (self._output_places, self._asked_places, self._local_places, self._calculated_places):
            _read(places, part)

    def read_outputs(self, part: Any, time: float) -> None:
        """Read the outputs after a step; other variables are read once they are asked for.

        Raises
        ------
        AdapterError
            If an output is not finite.
        """
        for place, port in self._output_places:
            place[...] = port.read(part)
        self.stale_from = self._first_asked
        if not _surely_finite(self._outputs):
            self.check_outputs(time)

    def read_asked(self, part: Any, highest: int = _NOTHING) -> None:
        """Read what is out of date up to a value reference: outputs that are computed when asked for, then the rest."""
        if self.stale_from < self._first_local:
            _read(self._asked_places, part)
            self.stale_from = self._first_local
        if highest >= self._first_local:
            _read(self._local_places, part)
            self.stale_from = _NOTHING

    def expect_initialisation(self, is_expected: bool = True) -> None:
        """Mark everything computed as out of date until the part is initialised, or nothing at all."""
        self.stale_from = self._first_output if is_expected else _NOTHING

    @property
    def is_stale(self) -> bool:
        """Whether any value is out of date."""
        return self.stale_from != _NOTHING

    def check_outputs(self, time: float) -> None:
        """Raise ``AdapterError`` if an output is not finite."""
        self._check_finite(self.table.outputs, time, "output", "the model is unstable, try a shorter step")

    def forget_results(self) -> None:
        """Make everything computed NaN, so that nobody can take it for a result."""
        self.values[self._first_output :] = np.nan

    def _check_finite(self, where: slice, time: float, kind: str, why: str) -> None:
        for reference in range(where.start, where.stop):
            value = self.values[reference]
            if not math.isfinite(value):
                name = self.table.name(reference)
                raise AdapterError(f"{kind} {name} is {value} at t = {time:.9g} s: {why}")

    def _places(self, kind: slice, ports: Sequence[Port]) -> list[tuple[FloatArray, Port]]:
        return [(self.values[place], port) for place, port in self.table.places(kind, ports)]


def _read(places: Sequence[tuple[FloatArray, Port]], part: Any) -> None:
    for place, port in places:
        place[...] = port.read(part)


def _reshaped(place: FloatArray, port: Port, shape: tuple[int, ...]) -> FloatArray:
    if math.prod(shape) != len(port.signals):
        count, first = math.prod(shape), port.signals[0].name
        raise AdapterError(
            f"{first} and its like are {count} values, the FMU has {len(port.signals)}: "
            "a change of how many there are needs another FMU, built from an edited definition"
        )
    return place.reshape(shape)


def _surely_finite(values: FloatArray) -> bool:
    """Return False if a value is not finite, or if they are too large to be added; cheap, and never warns."""
    return math.isfinite(sum(values.tolist()))
