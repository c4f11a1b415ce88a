"""The FMI side of a part: phases and steps; no physics.

pythonfmu calls the methods of ``Adapter`` from C++. An exception that reached it would become ``fmi2Fatal`` and
leave an instance that crashes when it is freed, so none may leave a method here. To pythonfmu only ``do_step`` can
return another status than OK: a failure anywhere else is reported at once (log and standard error; the loader, which
sees the log, makes it the status of the call), the computed variables become NaN, so that a host that reads neither
cannot take them for results, and the next ``do_step`` is refused with the text.

An adapter owns three parts, none of which knows it: the values of its variables, its failures, and the states that it
hands out.

The class is large because every function of FMI that pythonfmu passes on is a method of it.
"""

from __future__ import annotations

import ctypes
import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar, Generic, NoReturn, Protocol, TypeVar, cast
from xml.etree.ElementTree import Element

import numpy as np
from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from fmus.slave.model_description import describe
from fmus.slave.ports import Ports, Table
from fmus.slave.saved_state import SavedState, StateError
from fmus.slave.slave_failures import AdapterError, SlaveFailures, clean, explain
from fmus.slave.variable_values import VariableValues
from models.arrays import FloatArray, Snapshot
from models.definition_files.parameter import Definition, Parameter

#: A step may begin this share of its length away from where the model is: hosts sum up time.
_TIME_TOLERANCE = 1e-3
_NOTHING_TOLD: list[str] = []


class Part(Protocol):
    """What every part can do, whatever its ports are."""

    def snapshot(self) -> Snapshot:
        """Return the whole state."""

    def restore(self, snapshot: Snapshot) -> None:
        """Take a state back."""


DefinitionT = TypeVar("DefinitionT", bound=Definition)
PartT = TypeVar("PartT", bound=Part)


def hold(names: dict[str, Any]) -> None:
    """Add a reference to the namespace of a script that pythonfmu loads.

    Its loader runs the script once more for every instance and then releases the script's ``globals()`` without having
    owned them; without this call the second instance in a process would crash. No container may hold that reference:
    it would give back, when Python ends, what the loader has taken away.

    The loader also puts the script's folder in front of ``sys.path``, once for every instance. The script has imported
    all that it ever will, so the folder goes again: a thousand instances would make every import of the host slow.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(names))
    folder = str(Path(names["__file__"]).parent)
    sys.path[:] = [place for place in sys.path if place != folder]


class _Phase(Enum):
    INSTANTIATED = "instantiated"
    INITIALIZING = "initializing"
    STEPPING = "stepping"


class Adapter(Fmi2Slave, ABC, Generic[DefinitionT, PartT]):  # type: ignore[misc]
    """A part as an FMI 2.0 co-simulation slave.

    A subclass names the part's ports. The part is built when its outputs are first asked for in initialization mode, at
    the latest when that ends: hosts set parameters in different phases.

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
        self._failures = SlaveFailures(f"{type(self).__name__} ({self.instance_name})")
        self._phase = _Phase.INSTANTIATED
        self._time = 0.0
        self._longest_step = 0.0
        try:
            self._definition = self._read_definition(Path(self.resources) / "definition.toml")
            self._part = self._make_part(self._definition)
            self._variables = VariableValues(Table(self._definition.parameters(), self._make_ports(self._part)))
        except Exception as error:
            text = self._failures.announce(error)
            self.log(text, Fmi2Status.error)
            raise AdapterError(text) from None
        self._part_parameters = self._variables.parameters.tobytes()
        self._is_built = False
        self._initialised_with = b""

    # What a subclass says about its part.

    @abstractmethod
    def _read_definition(self, path: Path) -> DefinitionT:
        """Return the definition in the file, checked."""

    @abstractmethod
    def _make_part(self, definition: DefinitionT) -> PartT:
        """Return a part, not built yet."""

    def design_problem(self) -> str:
        """Return what is wrong with the definition that no reader sees, as far as it is soon found; empty if nothing.

        It is asked for when an FMU is built.
        """
        return ""

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

    def _start_warnings(self, part: PartT, inputs: FloatArray) -> Iterable[str]:
        """Return what deserves a second look in a part that has just been initialised."""
        return ()

    def _start_remark(self, part: PartT) -> str:
        """Return what the log may say about a part that has just been initialised, as no warning."""
        return ""

    def _step_warning(self, part: PartT, step: float) -> str:
        """Return what is wrong with steps of a length that the part can make nevertheless."""
        return ""

    def _told(self, part: PartT) -> list[str]:
        """Return what a part has to say of its steps; whoever reads it empties the list."""
        return _NOTHING_TOLD

    # Phases, called by pythonfmu.

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Take the start time."""
        self._time = start_time

    def enter_initialization_mode(self) -> None:
        """From here on outputs can be asked for."""
        self._phase = _Phase.INITIALIZING
        self._variables.expect_initialisation()

    def exit_initialization_mode(self) -> None:
        """Build the part if nobody asked for an output yet; parameters are fixed from here on."""
        known = self._failures.current
        self._initialise_if_changed()
        self._phase = _Phase.STEPPING
        self._variables.expect_initialisation(False)
        if not self._failures.current:
            self._look_at_start()
        elif self._failures.current == known:
            self.log(known, Fmi2Status.error)  # reported before; the loader makes it the status of this call too

    def _initialise_if_changed(self) -> None:
        wanted = self._variables.known(self._time)
        if wanted == self._initialised_with:
            return
        self._initialised_with = wanted
        self._failures.broken = ""
        try:
            self._make_part_for(self._variables.parameters)
            self._build_part(self._time, self._variables.checked_inputs(self._time))
            self._variables.read_all(self._part)
            self._variables.check_outputs(self._time)
        except BaseException as error:
            self._break_down(error)

    def _make_part_for(self, parameters: FloatArray) -> None:
        if parameters.tobytes() == self._part_parameters:
            return
        changed = self._variables.changed_parameters(parameters)
        self._part = self._make_part(cast(DefinitionT, self._definition.with_values(changed)))
        self._part_parameters = parameters.tobytes()
        self._is_built = False

    def _build_part(self, time: float, inputs: FloatArray) -> None:
        self._initialise(self._part, time, inputs)
        self._is_built = True
        self._variables.fit(self._part)

    # Steps, called by pythonfmu.

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Step the part; False (``fmi2Discard``) with the reason in the log if it cannot."""
        try:
            self._check_step(current_time, step_size)
            if step_size > self._longest_step:
                self._look_at_step(step_size)
            self._advance(self._part, self._variables.checked_inputs(current_time), step_size)
            self._time = current_time + step_size
            self._variables.read_outputs(self._part, self._time)
            if told := self._told(self._part):
                self._pass_on(told)
        except BaseException as error:
            self._break_down(error)
            return False
        return True

    def _check_step(self, time: float, step: float) -> None:
        is_ready = self._phase is _Phase.STEPPING and not self._failures.current
        if not (is_ready and 0.0 < step < math.inf and abs(time - self._time) <= _TIME_TOLERANCE * step):
            self._refuse_step(time, step)

    def _refuse_step(self, time: float, step: float) -> NoReturn:
        if self._failures.current:
            raise AdapterError(self._failures.current)
        if self._phase is not _Phase.STEPPING:
            raise AdapterError("a step was asked for before initialization mode ended")
        if not step > 0.0 or not math.isfinite(step):
            raise AdapterError(f"a step of {step:.9g} s at t = {time:.9g} s: it must be longer than 0")
        raise AdapterError(
            f"a step from t = {time:.9g} s, but the model is at t = {self._time:.9g} s: "
            "continue from there, or restore a state saved at the wanted time"
        )

    # Values, called by pythonfmu.

    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values; computed ones are brought up to date first."""
        if not vrs:
            return []
        try:
            places, _, highest = self._variables.find(vrs)
            if highest >= self._variables.stale_from:
                self._bring_up_to_date(highest)
            return self._variables.values[places].tolist()
        except BaseException as error:
            self._refuse(error)
            return [math.nan] * len(vrs)

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set inputs at any time, parameters until initialization mode ends."""
        if not vrs:
            return
        try:
            self._variables.set(vrs, values, are_parameters_fixed=self._phase is _Phase.STEPPING)
        except BaseException as error:
            self._refuse(error)

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Return whole-number parameters."""
        return [int(v) if math.isfinite(v) else 0 for v in self.get_real(vrs)]

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

    def _bring_up_to_date(self, highest: int = sys.maxsize) -> None:
        if self._phase is _Phase.INITIALIZING:
            self._initialise_if_changed()
        elif not self._failures.current:
            self._variables.read_asked(self._part, highest)

    def _refuse_type(self, references: list[int], kind: str) -> None:
        if references:
            self._refuse(AdapterError(f"the FMU has no {kind} variables (value reference {references[0]} asked for)"))

    # State, called by pythonfmu under these names.

    def _get_fmu_state(self) -> SavedState:
        try:
            return self._save()
        except BaseException as error:
            text = self._failures.announce(error)
            self.log(text, Fmi2Status.error)
            return SavedState(problem=text)

    def _set_fmu_state(self, state: SavedState) -> None:
        try:
            self._restore(state)
        except BaseException as error:
            self._refuse(error)

    @staticmethod
    def _fmu_state_to_bytes(state: SavedState) -> bytes:
        try:
            return state.to_bytes()
        except BaseException as error:
            return SavedState(problem=explain(error)).to_bytes()

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> SavedState:
        # No instance is here that could log: the problem travels to ``_set_fmu_state``.
        try:
            return SavedState.from_bytes(data)
        except BaseException as error:
            return SavedState(problem=explain(error))

    def _save(self) -> SavedState:
        if self._variables.is_stale:
            self._bring_up_to_date()
        header = {
            "fingerprint": self.fingerprint,
            "model": str(self.modelName),
            "phase": self._phase.value,
            "refused": self._failures.refused,
            "broken": self._failures.broken,
        }
        part: Snapshot | None = None
        if self._phase is not _Phase.INSTANTIATED and not self._failures.current:
            part = {name: np.array(array) for name, array in self._part.snapshot().items()}
        return SavedState(header, self._variables.values.copy(), self._time, part)

    def _restore(self, state: SavedState) -> None:
        if not isinstance(state, SavedState):
            raise StateError("what was given is not a saved state")
        state.check(self.fingerprint, str(self.modelName), len(self._variables.values))
        if state.part is not None:
            self._restore_part(state, state.part)
        self._variables.values[:] = state.values
        self._time = state.time
        self._phase = _Phase(state.header["phase"])
        self._failures.restore(state.header["refused"], state.header["broken"])
        self._variables.expect_initialisation(self._phase is _Phase.INITIALIZING)
        self._initialised_with = b"" if state.part is None else self._variables.known(self._time)

    def _restore_part(self, state: SavedState, part: Snapshot) -> None:
        self._make_part_for(state.values[self.table.parameters])
        if not self._is_built:
            # Whatever the state's inputs are, the start values are fit to build with.
            self._build_part(state.time, self.table.start_values()[self.table.inputs])
        self._part.restore(part)

    # Warnings and failures.

    def _look_at_start(self) -> None:
        try:
            for text in self._start_warnings(self._part, self._variables.inputs.copy()):
                self._warn(text)
            if remark := self._start_remark(self._part):
                self.log(clean(remark), Fmi2Status.ok)
        except BaseException as error:
            self._break_down(error)

    def _look_at_step(self, step: float) -> None:
        """Warn of the first step that is too long, of that alone."""
        text = self._step_warning(self._part, step)
        self._longest_step = math.inf if text else step
        self._warn(text)

    def _pass_on(self, told: list[str]) -> None:
        for text in told:
            self._warn(text)
        told.clear()

    def _warn(self, text: str) -> None:
        if text:
            self.log(clean(text), Fmi2Status.warning)

    def _refuse(self, error: BaseException) -> None:
        self.log(self._failures.refuse(error), Fmi2Status.error)
        self._variables.forget_results()

    def _break_down(self, error: BaseException) -> None:
        if text := self._failures.break_down(error):
            self.log(text, Fmi2Status.error)
        self._variables.forget_results()

    # Description, called by the build.

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Return the model description."""
        return describe(self, self.table, super().to_xml)

    @property
    def table(self) -> Table:
        """Every variable."""
        return self._variables.table

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The definition's parameters."""
        return self._definition.parameters()
