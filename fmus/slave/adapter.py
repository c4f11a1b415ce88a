"""The FMI side of a part: variables, phases, state and errors; no physics.

pythonfmu calls the methods of ``Adapter`` from C++. An exception that reached it would become
``fmi2Fatal`` and leave an instance that crashes when it is freed, so none may leave a method here. To pythonfmu only
``do_step`` can return another status than OK: a failure anywhere else is told at once (log and standard
error; the loader, which sees the log, makes it the status of the call), the computed variables become NaN, so that
a host that reads neither cannot take them for results, and the next ``do_step`` is refused with the text.
"""

from __future__ import annotations

import ctypes
import math
import sys
import traceback
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar, Generic, NoReturn, Protocol, TypeVar, cast
from xml.etree.ElementTree import Element

import numpy as np
from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from fmus.slave.model_description import describe
from fmus.slave.ports import Port, Ports, Table
from fmus.slave.saved_state import StateError, pack, unpack
from models.arrays import FloatArray, Snapshot
from models.definition_files.parameter import Definition, Parameter

#: A step may begin this share of its length away from where the model is: hosts sum up time.
_TIME_TOLERANCE = 1e-3


class Part(Protocol):
    """What every part can do, whatever its ports are."""

    def snapshot(self) -> Snapshot:
        """Return the whole state."""

    def restore(self, snapshot: Snapshot) -> None:
        """Take a state back."""


DefinitionT = TypeVar("DefinitionT", bound=Definition)
PartT = TypeVar("PartT", bound=Part)


#: Beyond every value reference: no value is out of date.
_NOTHING = sys.maxsize


def hold(names: dict[str, Any]) -> None:
    """Add a reference to the namespace of a script that pythonfmu loads.

    Its loader runs the script once more for every instance and then releases the script's ``globals()``
    without having owned them; without this call the second instance in a process would crash. No container
    may hold that reference: it would give back, when Python ends, what the loader has taken away.

    The loader also puts the script's folder in front of ``sys.path``, once for every instance. The script has imported
    all that it ever will, so the folder goes again: a thousand instances would make every import of the host slow.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(names))
    folder = str(Path(names["__file__"]).parent)
    sys.path[:] = [place for place in sys.path if place != folder]


class AdapterError(RuntimeError):
    """A call that the FMU cannot honour; its text is meant for the user."""


class _Phase(Enum):
    INSTANTIATED = "instantiated"
    INITIALIZING = "initializing"
    STEPPING = "stepping"


class _SavedState:
    """What a host holds between getting and setting a state; ``problem`` says why it cannot be used."""

    def __init__(self, about: Mapping[str, str], arrays: Snapshot, problem: str = "") -> None:
        self.about = dict(about)
        self.arrays = arrays
        self.problem = problem


class Adapter(Fmi2Slave, ABC, Generic[DefinitionT, PartT]):  # type: ignore[misc]
    """A part as an FMI 2.0 co-simulation slave.

    A subclass names the part's ports. The part is built when its outputs are first asked for in
    initialization mode, at the latest when that ends: hosts set parameters in different phases.

    Attributes
    ----------
    fingerprint : str
        Content hash of the FMU, its GUID; set by the build.
    models : str
        What is modelled, a paragraph for the page inside the FMU.
    limits : tuple of str
        What is not, for the same page.
    """

    fingerprint: ClassVar[str] = ""
    models: ClassVar[str] = "See the definition below."
    limits: ClassVar[tuple[str, ...]] = ()
    license: ClassVar[str] = "MIT"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.guid = self.fingerprint
        self._refused = ""  # what the host did wrong: stays until a state is restored
        self._broken = ""  # what the part could not do: tried again when a value changes
        self._told = False
        try:
            self._prepare(Path(self.resources) / "definition.toml")
        except Exception as error:
            text = self._tell(_explain(error))
            raise AdapterError(text) from None

    # What a subclass says about its part.

    @abstractmethod
    def _read_definition(self, path: Path) -> DefinitionT:
        """Return the definition in the file, checked."""

    @abstractmethod
    def _make_part(self, definition: DefinitionT) -> PartT:
        """Return a part, not built yet."""

    @abstractmethod
    def _make_ports(self, part: PartT) -> Ports:
        """Name the part's arrays; ``part`` is not built."""

    @abstractmethod
    def _initialise(self, part: PartT, time: float, inputs: FloatArray) -> None:
        """Build the part and make its outputs consistent with the inputs."""

    @abstractmethod
    def _advance(self, part: PartT, inputs: FloatArray, step: float) -> None:
        """Let the part step from its time to its time plus ``step``."""

    # What a subclass may say about its part; empty texts say nothing.

    def _doubts(self, part: PartT, inputs: FloatArray) -> Iterable[str]:
        """Return what deserves a second look in a part that has just been initialised."""
        return ()

    def _step_doubt(self, part: PartT, step: float) -> str:
        """Return what is wrong with steps of a length that the part can make nevertheless."""
        return ""

    # Life cycle, called by pythonfmu.

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Take the start time."""
        self._time = start_time

    def enter_initialization_mode(self) -> None:
        """From here on outputs can be asked for."""
        self._phase = _Phase.INITIALIZING
        self._stale_from = self._table.outputs.start

    def exit_initialization_mode(self) -> None:
        """Build the part if nobody asked for an output yet; parameters are fixed from here on."""
        self._phase = _Phase.INITIALIZING
        known = self._failure
        self._initialise_if_changed()
        self._phase = _Phase.STEPPING
        self._stale_from = _NOTHING
        if not self._failure:
            self._look_at_start()
        elif self._failure == known:
            self.log(known, Fmi2Status.error)  # told before; the loader makes it the status of this call too

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Step the part; False (``fmi2Discard``) with the reason in the log if it cannot."""
        try:
            self._check_step(current_time, step_size)
            if step_size > self._longest_step:
                self._look_at_step(step_size)
            self._advance(self._part, self._checked_inputs(current_time), step_size)
            self._time = current_time + step_size
            self._read(self._output_places)
            self._stale_from = self._first_local
            self._check_outputs()
        except BaseException as error:
            self._break(error)
            return False
        return True

    # Values.

    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values; computed ones are brought up to date first."""
        if not vrs:
            return []
        try:
            places, _, highest = self._find(vrs)
            if highest >= self._stale_from:
                self._bring_up_to_date()
            return self._values[places].tolist()
        except BaseException as error:
            self._refuse(error)
            return [math.nan] * len(vrs)

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set inputs at any time, parameters until initialization mode ends."""
        if not vrs:
            return
        try:
            places, lowest, highest = self._find(vrs)
            if self._first_input <= lowest and highest < self._first_output:
                self._values[places] = values
            else:
                self._set_one_by_one(vrs, values)
        except BaseException as error:
            self._refuse(error)

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Return whole-number parameters."""
        values = self.get_real(vrs)
        return [int(v) if math.isfinite(v) else 0 for v in values]

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Set whole-number parameters."""
        self.set_real(vrs, [float(v) for v in values])

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Refuse: there are no Boolean variables."""
        self._refuse_type(vrs, "Boolean")
        return [False] * len(vrs)

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Refuse: there are no Boolean variables."""
        self._refuse_type(vrs, "Boolean")

    def get_string(self, vrs: list[int]) -> list[str]:
        """Refuse: there are no String variables."""
        self._refuse_type(vrs, "String")
        return [""] * len(vrs)

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Refuse: there are no String variables."""
        self._refuse_type(vrs, "String")

    # State, called by pythonfmu under these names.

    def _get_fmu_state(self) -> _SavedState:
        try:
            return self._save()
        except BaseException as error:
            return _SavedState({}, {}, self._tell(_explain(error)))

    def _set_fmu_state(self, state: _SavedState) -> None:
        try:
            self._restore(state)
        except BaseException as error:
            self._refuse(error)

    @staticmethod
    def _fmu_state_to_bytes(state: _SavedState) -> bytes:
        try:
            return pack({**state.about, "problem": state.problem}, state.arrays)
        except BaseException as error:
            return pack({"problem": _clean(_explain(error))}, {})

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> _SavedState:
        # There is no instance to tell here: the problem travels to ``_set_fmu_state``.
        try:
            about, arrays = unpack(data)
            return _SavedState(about, arrays, about.pop("problem", ""))
        except BaseException as error:
            return _SavedState({}, {}, _explain(error))

    # Description, called by the build.

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Return the model description; only the build asks for it."""
        return describe(self, self._table, super().to_xml)

    @property
    def table(self) -> Table:
        """Every variable; only the build asks for it."""
        return self._table

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The definition's parameters; only the build asks for them."""
        return self._definition.parameters()

    # Inside.

    def _prepare(self, path: Path) -> None:
        self._definition = self._read_definition(path)
        self._part = self._make_part(self._definition)
        self._table = table = Table(self._definition.parameters(), self._make_ports(self._part))
        self._values = table.start_values()
        self._starts = self._values[table.parameters].copy()
        self._first_input, self._first_output, self._first_local = (
            kind.start for kind in (table.inputs, table.outputs, table.local)
        )
        self._references = list(range(len(table)))
        # Views: whoever writes to the values must write into the array, not replace it.
        self._inputs, self._outputs = self._values[table.inputs], self._values[table.outputs]
        self._output_places = self._places(table.outputs, table.ports.outputs)
        self._local_places = self._places(table.local, table.ports.local)
        self._calculated_places = self._places(table.calculated, table.ports.calculated)
        self._phase = _Phase.INSTANTIATED
        self._time = 0.0
        self._longest_step = 0.0
        self._stale_from = _NOTHING
        self._part_parameters = self._starts.tobytes()
        self._is_built = False
        self._tried = b""

    def _bring_up_to_date(self) -> None:
        if self._phase is _Phase.INITIALIZING:
            self._initialise_if_changed()
        elif not self._failure:
            self._read(self._local_places)
            self._stale_from = _NOTHING

    def _initialise_if_changed(self) -> None:
        wanted = self._wanted()
        if wanted == self._tried:
            return
        self._tried = wanted
        self._broken = ""
        try:
            self._initialise_part()
        except BaseException as error:
            self._break(error)

    def _wanted(self) -> bytes:
        known = self._values[: self._table.inputs.stop]
        return known.tobytes() + np.float64(self._time).tobytes()

    def _initialise_part(self) -> None:
        self._make_part_for(self._values[self._table.parameters])
        self._build_part(self._time, self._checked_inputs(self._time))
        for places in (self._output_places, self._local_places, self._calculated_places):
            self._read(places)
        self._check_outputs()

    def _build_part(self, time: float, inputs: FloatArray) -> None:
        self._initialise(self._part, time, inputs)
        self._is_built = True
        for places in (self._output_places, self._local_places, self._calculated_places):
            self._fit(places)

    def _make_part_for(self, parameters: FloatArray) -> None:
        if parameters.tobytes() == self._part_parameters:
            return
        changed = {
            self._table.name(i): float(parameters[i])
            for i in range(len(parameters))
            if parameters[i] != self._starts[i]  # NaN differs too, and is refused by the definition
        }
        self._part = self._make_part(cast(DefinitionT, self._definition.with_values(changed)))
        self._part_parameters = parameters.tobytes()
        self._is_built = False

    def _checked_inputs(self, time: float) -> FloatArray:
        # A copy: a part may keep what it was given, to extrapolate from it.
        inputs = self._inputs.copy()
        if not _surely_finite(inputs):
            self._check_finite(self._table.inputs, time, "input", "the part that it comes from has failed")
        return inputs

    def _check_outputs(self) -> None:
        if not _surely_finite(self._outputs):
            why = "the model is unstable, try a shorter step"
            self._check_finite(self._table.outputs, self._time, "output", why)

    def _check_finite(self, where: slice, time: float, kind: str, why: str) -> None:
        for reference in range(where.start, where.stop):
            value = self._values[reference]
            if not math.isfinite(value):
                name = self._table.name(reference)
                raise AdapterError(f"{kind} {name} is {value} at t = {time:.9g} s: {why}")

    def _places(self, kind: slice, ports: Sequence[Port]) -> list[tuple[FloatArray, Port]]:
        return [(self._values[place], port) for place, port in self._table.places(kind, ports)]

    def _fit(self, places: list[tuple[FloatArray, Port]]) -> None:
        """Give the places the shapes of the part's arrays, that these can be copied as they are."""
        for i, (place, port) in enumerate(places):
            shape = np.shape(port.read(self._part))
            if math.prod(shape) != len(port.signals):
                count, first = math.prod(shape), port.signals[0].name
                raise AdapterError(
                    f"{first} and its like are {count} values, the FMU has {len(port.signals)}: "
                    "a change of how many there are needs another FMU, built from an edited definition"
                )
            places[i] = place.reshape(shape), port

    def _read(self, places: Sequence[tuple[FloatArray, Port]]) -> None:
        for place, port in places:
            place[...] = port.read(self._part)

    def _check_step(self, time: float, step: float) -> None:
        is_ready = self._phase is _Phase.STEPPING and not (self._refused or self._broken)
        if not (is_ready and 0.0 < step < math.inf and abs(time - self._time) <= _TIME_TOLERANCE * step):
            self._refuse_step(time, step)

    def _refuse_step(self, time: float, step: float) -> NoReturn:
        if self._failure:
            raise AdapterError(self._failure)
        if self._phase is not _Phase.STEPPING:
            raise AdapterError("a step was asked for before initialization mode ended")
        if not step > 0.0 or not math.isfinite(step):
            raise AdapterError(f"a step of {step:.9g} s at t = {time:.9g} s: it must be longer than 0")
        raise AdapterError(
            f"a step from t = {time:.9g} s, but the model is at t = {self._time:.9g} s: "
            "go on from there, or restore a state saved at the wanted time"
        )

    def _find(self, references: list[int]) -> tuple[slice | list[int], int, int]:
        """Return where variables lie, the lowest and the highest reference.

        A slice, which costs least, if they follow one another, as what hosts ask for again and again mostly does.
        """
        first, last = references[0], references[-1]
        run = slice(first, last + 1)
        if self._references[run] == references:
            return run, first, last
        highest = max(references)
        if highest >= len(self._references):
            raise AdapterError(f"the FMU has no variable with value reference {highest}")
        return references, min(references), highest

    def _set_one_by_one(self, references: Sequence[int], values: Sequence[float]) -> None:
        for reference, value in zip(references, values, strict=True):
            variable = self._table.variables[reference]
            if variable.causality == "parameter":
                self._set_parameter(reference, value)
            elif variable.causality == "input":
                self._values[reference] = value
            else:
                raise AdapterError(f"{variable.signal.name} is computed by the FMU and cannot be set")

    def _set_parameter(self, reference: int, value: float) -> None:
        if self._phase is _Phase.STEPPING and value != self._values[reference]:
            raise AdapterError(
                f"parameter {self._table.name(reference)} cannot change from {self._values[reference]:.9g} "
                f"to {value:.9g} after initialization: reset the FMU, or make a new instance"
            )
        self._values[reference] = value

    def _refuse_type(self, references: Sequence[int], kind: str) -> None:
        if references:
            text = f"the FMU has no {kind} variables (value reference {references[0]} asked for)"
            self._refuse(AdapterError(text))

    # Warnings.

    def _look_at_start(self) -> None:
        try:
            for text in self._doubts(self._part, self._inputs.copy()):
                self._warn(text)
        except BaseException as error:
            self._break(error)

    def _look_at_step(self, step: float) -> None:
        """Warn of the first step that is too long, of that alone."""
        text = self._step_doubt(self._part, step)
        self._longest_step = math.inf if text else step
        self._warn(text)

    def _warn(self, text: str) -> None:
        if text:
            self.log(_clean(text), Fmi2Status.warning)

    # Saving and restoring.

    def _save(self) -> _SavedState:
        if self._stale_from != _NOTHING:
            self._bring_up_to_date()
        arrays: Snapshot = {"values": self._values.copy(), "time": np.array(self._time)}
        is_alive = self._phase is not _Phase.INSTANTIATED and not self._failure
        if is_alive:
            arrays |= {f"part.{name}": np.array(array) for name, array in self._part.snapshot().items()}
        about = {
            "fingerprint": self.fingerprint,
            "model": str(self.modelName),
            "phase": self._phase.value,
            "refused": self._refused,
            "broken": self._broken,
            "alive": "yes" if is_alive else "no",
        }
        return _SavedState(about, arrays)

    def _restore(self, state: _SavedState) -> None:
        self._check_state(state)
        values, time = np.asarray(state.arrays["values"], np.float64), float(state.arrays["time"])
        if state.about["alive"] == "yes":
            self._restore_part(state, values, time)
        self._values[:] = values
        self._time = time
        self._phase = _Phase(state.about["phase"])
        self._refused, self._broken = state.about["refused"], state.about["broken"]
        self._told = bool(self._failure)
        is_initializing = self._phase is _Phase.INITIALIZING
        self._stale_from = self._table.outputs.start if is_initializing else _NOTHING
        self._tried = self._wanted() if state.about["alive"] == "yes" else b""

    def _check_state(self, state: _SavedState) -> None:
        if not isinstance(state, _SavedState):
            raise StateError("what was given is not a saved state")
        if state.problem:
            raise StateError(state.problem)
        if state.about.get("fingerprint") != self.fingerprint:
            raise StateError(
                f"the saved state belongs to {state.about.get('model')} ({state.about.get('fingerprint')}), "
                f"not to {self.modelName} ({self.fingerprint})"
            )
        if state.arrays["values"].shape != self._values.shape:
            raise StateError("the saved state has another number of variables")

    def _restore_part(self, state: _SavedState, values: FloatArray, time: float) -> None:
        self._make_part_for(values[self._table.parameters])
        if not self._is_built:
            # Whatever the state's inputs are, the start values are fit to build with.
            self._build_part(time, self._table.start_values()[self._table.inputs])
        arrays = state.arrays.items()
        self._part.restore({name.removeprefix("part."): a for name, a in arrays if name.startswith("part.")})

    # Failures.

    @property
    def _failure(self) -> str:
        return self._refused or self._broken

    def _refuse(self, error: BaseException) -> None:
        if self._refused:
            self.log(_clean(_explain(error)), Fmi2Status.error)  # the status of this call too
        else:
            self._refused = self._tell(_explain(error))
        self._forget_results()

    def _break(self, error: BaseException) -> None:
        text = _clean(_explain(error))
        if text != self._failure:
            self._broken = self._tell(text)
        elif not self._told:
            self.log(text, Fmi2Status.error)  # once more where the host can connect it with a status
            self._told = True
        self._forget_results()

    def _forget_results(self) -> None:
        self._values[self._table.outputs.start :] = np.nan

    def _tell(self, text: str) -> str:
        text = _clean(text)
        self.log(text, Fmi2Status.error)
        who = f"{type(self).__name__} ({_clean(str(self.instance_name))})"
        print(f"{who}: {text}", file=sys.stderr, flush=True)
        self._told = False
        return text


def _surely_finite(values: FloatArray) -> bool:
    """Return False if a value is not finite, or if they are too large to be added; cheap, and never warns."""
    return math.isfinite(sum(values.tolist()))


def _explain(error: BaseException) -> str:
    """Return why it failed; for errors nobody put into words, with their place in the source."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted from the keyboard"
    text = str(error) or type(error).__name__
    if not _is_foreign(type(error)):
        return text
    place = traceback.extract_tb(error.__traceback__)[-1:]
    where = f" in {Path(place[0].filename).name}, line {place[0].lineno}" if place else ""
    return f"{text} ({type(error).__name__}{where})"


def _is_foreign(error: type[BaseException]) -> bool:
    return error.__module__.partition(".")[0] in {"builtins", "numpy", "scipy"}


def _clean(text: str) -> str:
    """Return text that is safe as a C host's printf format and as UTF-8.

    Examples
    --------
    >>> _clean("slipped by 3%")
    'slipped by 3 percent'
    """
    spelled = text.replace(" %", " percent").replace("%", " percent")
    return spelled.encode("utf-8", "replace").decode("utf-8")
