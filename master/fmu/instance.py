"""An FMU instance: grouped reading and writing, parameters, steps, state, readable errors.

Values pass through preallocated arrays that ctypes and NumPy share, and one FMI call moves a whole group: an
exchange costs no more than the FMI call itself.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from contextlib import chdir
from ctypes import byref, c_char, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from time import perf_counter
from typing import Any, Final

import numpy as np
from fmpy.fmi2 import FMU2Slave

from master.arrays import FloatArray
from master.errors import SlaveError, one_line
from master.fmu import fmi_log
from master.fmu.extraction import ExtractedFmu
from master.fmu.typed_values import TypedValues
from master.ssp.ssv import Value
from master.system.components import Component, Variable

_STATUS: Final = ("ok", "warning", "discard", "error", "fatal", "pending")
#: What counts as success: ok and warning. A number that FMI does not know, a negative one too, is a failure.
_GOOD: Final = (0, 1)
#: After these an instance must not be called any more; nor after a number that FMI does not know.
_LIVING: Final = range(4)
_DISCARD: Final = 2
#: Kinds of fmi2StatusKind: the time of the last step that succeeded, and whether the FMU wants to end.
_LAST_TIME: Final = 2
_TERMINATED: Final = 3
#: Largest state that is taken from an FMU [bytes].
LONGEST_STATE: Final = 1 << 30


class Group:
    """Variables of an instance that are read or written with one call if all are Real, with one for every type else.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Where `read` puts them and `write` takes them from.
    """

    def __init__(self, instance: Instance, names: Sequence[str], values: FloatArray | None = None) -> None:
        n = len(names)
        self.names = tuple(names)
        self.values: FloatArray = np.zeros(n) if values is None else values
        references = [instance.component.fmu.variables[name].reference for name in names]
        self._references = (c_uint * n)(*references)
        self._buffer = (c_double * n).from_buffer(self.values.data) if n else (c_double * 0)()
        # Of the C types already: converting and checking the same arguments each time would cost half as much again.
        self._arguments = (c_void_p(instance.handle), self._references, c_size_t(n), self._buffer)
        self._get, self._set = instance.bare_function("fmi2GetReal"), instance.bare_function("fmi2SetReal")
        self._instance = instance
        kinds = [instance.component.fmu.variables[name].type for name in names]
        self._typed = (
            None
            if all(kind == "Real" for kind in kinds)
            else TypedValues(kinds, references, self.values, instance.exchange)
        )

    def read(self) -> None:
        """Fill `values` from the FMU."""
        if self._typed is not None:
            self._typed.read()
        elif self.names and (status := self._get(*self._arguments)) not in _GOOD:
            raise self._instance.error("reading its variables", status)

    def write(self) -> None:
        """Set the FMU's variables to `values`."""
        if self._typed is not None:
            self._typed.write()
        elif self.names and (status := self._set(*self._arguments)) not in _GOOD:
            raise self._instance.error("setting its inputs", status)


class Instance:
    """An FMU of the system, loaded; a `Slave` for the coupling algorithms.

    The order of calls: `bind`, `start`, then `write` and `read` as often as needed, `finish_initialisation`,
    then `step` and exchanges, at last `close`.

    Parameters
    ----------
    component : Component
        What to load.

    Attributes
    ----------
    stepping_time : float
        Wall time spent in steps so far [s].

    Raises
    ------
    SlaveError
        If the FMU cannot be loaded or instantiated.
    """

    def __init__(self, component: Component) -> None:
        self.component = component
        self.name = component.name
        self.input_names = component.inputs
        self.output_names = component.outputs
        self.time = float("nan")
        self.stepping_time = 0.0
        self._bound: tuple[FloatArray, FloatArray] | None = None
        self._dead = False
        fmi_log.clear(self.name)
        self._fmu = self._load()
        self.handle = self._fmu.component
        self._do_step = self.bare_function("fmi2DoStep")
        # Of the C types already, see `Group`.
        self._at, self._length = c_double(), c_double()
        self._step_arguments = (c_void_p(self.handle), self._at, self._length, c_int(1))

    def function(self, name: str) -> Callable[..., int]:
        """Return an FMI function of the library; FMPy has declared its argument types."""
        return getattr(self._fmu.dll, name)

    def bare_function(self, name: str) -> Callable[..., int]:
        """Return an FMI function of the library that takes arguments of the C types themselves, and nothing else."""
        function: Callable[..., int] = self._fmu.dll[name]
        return function

    def exchange(self, function: str, references: Any, count: int, buffer: Any) -> None:
        """Read or write variables of one type with an FMI function.

        Raises
        ------
        SlaveError
            If the FMU refuses.
        """
        doing = "setting its inputs" if function.startswith("fmi2Set") else "reading its variables"
        self._call(doing, function, references, count, buffer)

    def group(self, names: Sequence[str]) -> Group:
        """Return a group for further variables, e.g. for recording."""
        return Group(self, names)

    def bind(self, inputs: FloatArray, outputs: FloatArray) -> None:
        """Exchange through these arrays from now on."""
        self._inputs = Group(self, self.input_names, inputs)
        self._outputs = Group(self, self.output_names, outputs)
        self._bound = None

    def read_along(self, names: Sequence[str]) -> FloatArray:
        """Return where further variables are from now on, which are read with the bound outputs, by the same call.

        To be called once, after `bind`.
        """
        count = len(self.output_names)
        together = Group(self, (*self.output_names, *names))
        self._bound = together.values[:count], self._outputs.values
        self._outputs = together
        return together.values[count:]

    def start(self, start: float, stop: float) -> None:
        """Set up the experiment, set the parameters, enter initialization mode."""
        self.time = start
        tolerance = self.component.tolerance
        wanted = (0, 0.0) if tolerance is None else (1, tolerance)
        self._call("setting up the experiment", "fmi2SetupExperiment", *wanted, start, 1, stop)
        for name, value in self.component.parameters.items():
            self._set(self.component.fmu.variables[name], value)
        self._call("entering initialization", "fmi2EnterInitializationMode")

    def finish_initialisation(self) -> None:
        """Leave initialization mode."""
        self._call("its initialization", "fmi2ExitInitializationMode")

    def write(self) -> None:
        """Pass the bound inputs to the FMU."""
        self._inputs.write()

    def read(self) -> None:
        """Take the bound outputs from the FMU."""
        self._outputs.read()
        if self._bound is not None:
            found, bound = self._bound
            bound[:] = found

    def step(self, time: float, step: float) -> None:
        """Advance from ``time`` to ``time + step``."""
        self.time = self._at.value = time
        self._length.value = step
        began = perf_counter()
        status = self._do_step(*self._step_arguments)
        self.stepping_time += perf_counter() - began
        if status not in _GOOD:
            raise self.error("a step", status, self._ended() if status == _DISCARD else "")

    def save(self) -> c_void_p:
        """Return the FMU's state; hand it back to `release`."""
        state = c_void_p()
        self._call("saving its state", "fmi2GetFMUstate", byref(state))
        return state

    def restore(self, state: c_void_p) -> None:
        """Return to a saved state."""
        self._call("restoring its state", "fmi2SetFMUstate", state)

    def release(self, state: c_void_p) -> None:
        """Free a saved state."""
        self._call("freeing a state", "fmi2FreeFMUstate", byref(state))

    def serialise(self) -> bytes:
        """Return the state as bytes."""
        state, size = self.save(), c_size_t()
        try:
            self._call("serialising its state", "fmi2SerializedFMUstateSize", state, byref(size))
            data = self._room(size.value)
            self._call("serialising its state", "fmi2SerializeFMUstate", state, data, size.value)
            return data.raw
        finally:
            self.release(state)

    def _room(self, size: int) -> Any:
        """Return a buffer for a state of the size that the FMU claims."""
        claim = f"component '{self.name}' ({self.component.fmu.path.name}) claims a state of {size} bytes"
        if size > LONGEST_STATE:
            raise SlaveError(f"{claim}, more than the {LONGEST_STATE} that are read; it cannot be checkpointed")
        try:
            return (c_char * size)()
        except MemoryError as error:
            raise SlaveError(f"{claim}, for which there is no memory; it cannot be checkpointed") from error

    def deserialise(self, data: bytes) -> None:
        """Return to a state given as bytes."""
        state = c_void_p()
        buffer = (c_char * len(data)).from_buffer_copy(data)
        self._call("reading a state", "fmi2DeSerializeFMUstate", buffer, len(data), byref(state))
        try:
            self.restore(state)
        finally:
            self.release(state)

    def remark(self) -> str:
        """Return the FMU's last warning or error message."""
        return fmi_log.last_words(self.name)

    def warnings(self) -> tuple[str, ...]:
        """Return the FMU's warnings so far, each once and on one line."""
        return tuple(one_line(text) for text in fmi_log.warnings(self.name))

    def close(self) -> str:
        """Terminate and free the instance and its files; an FMU that died is only dropped.

        Returns
        -------
        str
            What went wrong, empty if nothing did: how an FMU ends does not affect what was computed.
        """
        said = ""
        if not self._dead:
            status = self.function("fmi2Terminate")(self.handle)
            said = "" if status in _GOOD else str(self.error("its termination", status))
        if not self._dead:
            self._dead = True
            self._fmu.freeInstance()
            self._extracted.release()
        self._extracted.remove()
        return said

    def error(self, doing: str, status: int, why: str = "") -> SlaveError:
        """Return the error for a failed call, with what is known of it and in the FMU's own words if it said any."""
        self._dead = self._dead or status not in _LIVING
        label = _STATUS[status] if 0 <= status < len(_STATUS) else f"{status}, which FMI does not know"
        words = fmi_log.last_words(self.name)
        said = f"{why}; it said: {words}" if why and words else why or words or "the FMU gave no reason"
        at = f" at t = {self.time:.6g} s" if self.time == self.time else ""
        who = f"component '{self.name}' ({self.component.fmu.path.name})"
        return SlaveError(f"{who} failed in {doing}{at}, status {label}: {said}")

    def _ended(self) -> str:
        """Return in words that the FMU has ended the simulation itself, empty if it has not [FMI 2.0.4, 4.2.3]."""
        ends, time = c_int(0), c_double(self.time)
        try:
            status = self.function("fmi2GetBooleanStatus")(self.handle, _TERMINATED, byref(ends))
            if status != 0 or not ends.value:
                return ""
            if self.function("fmi2GetRealStatus")(self.handle, _LAST_TIME, byref(time)) != 0:
                time.value = self.time
        except AttributeError:  # some libraries leave out what they do not use
            return ""
        return f"the FMU has ended the simulation at t = {time.value:.6g} s, before the stop time"

    def _call(self, doing: str, function: str, *arguments: Any) -> None:
        status = self.function(function)(self.handle, *arguments)
        if status not in _GOOD:
            raise self.error(doing, status)

    def _set(self, variable: Variable, value: Value) -> None:
        reference = (c_uint * 1)(variable.reference)
        if variable.type == "Real":
            name, buffer = "fmi2SetReal", (c_double * 1)(float(value))
        elif variable.type == "String":
            name, buffer = "fmi2SetString", (ctypes.c_char_p * 1)(str(value).encode())  # type: ignore[assignment]
        else:
            kind = "Boolean" if variable.type == "Boolean" else "Integer"
            name, buffer = f"fmi2Set{kind}", (c_int * 1)(int(value))  # type: ignore[assignment]
        self._call(f"setting parameter '{variable.name}' to {value}", name, reference, 1, buffer)

    def _load(self) -> Any:
        fmu = self.component.fmu
        try:
            self._extracted = extracted = ExtractedFmu(fmu)
        except Exception as error:
            raise self._unloadable(error) from error
        try:
            with chdir(Path.cwd()):  # FMPy goes into the library's folder, and stays there if that cannot be loaded
                slave = FMU2Slave(
                    instanceName=self.name,
                    guid=fmu.guid,
                    modelIdentifier=fmu.identifier,
                    unzipDirectory=extracted.folder,
                )
            slave.instantiate(callbacks=fmi_log.CALLBACKS, loggingOn=True)
        except Exception as error:  # FMPy raises bare exceptions
            extracted.remove()
            raise self._unloadable(error) from error
        return slave

    def _unloadable(self, error: Exception) -> SlaveError:
        said = fmi_log.last_words(self.name)
        reason = f"{error}" + (f": {said}" if said else "")
        return SlaveError(f"component '{self.name}': {self.component.fmu.path.name} cannot be loaded ({reason})")
