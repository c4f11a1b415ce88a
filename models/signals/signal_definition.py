"""What a signal is: columns of a table, what is made of them, how they go on between the rows."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, Literal

import numpy as np

from models.arrays import FloatArray
from models.definition_files.message_text import hint
from models.definition_files.parameter import Parameter, ParameterError
from models.definition_files.toml_reader import Table
from models.numerics.sampled_signal import INTERPOLATIONS, SampledSignal

#: The table itself, beside the definition: its rows one after the other, times first.
TABLE_FILE: Final = "signal.f64"
NUMBERS: Final = "<f8"
_CHOICE: Final = "choice: as in the file"
#: Name of the parameter that moves everything in time.
SHIFT: Final = "time_shift"
_LARGEST: Final = 1e9
Kind = Literal["value", "rate", "integral"]


@dataclass(frozen=True)
class Output:
    """What is told of a column.

    Attributes
    ----------
    name, unit : str
    column : int
    kind : str
        "value", "rate" or "integral".
    """

    name: str
    unit: str
    column: int
    kind: Kind


@dataclass(frozen=True)
class SignalDefinition:
    """Signals from a table.

    Attributes
    ----------
    name, title : str
    interpolation : str
        One of `models.numerics.sampled_signal.INTERPOLATIONS`.
    repeats : bool
    columns : tuple of (name, unit)
    outputs : tuple of Output
    table : SampledSignal
    gain, offset : ndarray, shape (k,)
        Of each column.
    time_shift : float
        How much later everything happens than the table says [s].
    """

    name: str
    title: str
    interpolation: str
    repeats: bool
    columns: tuple[tuple[str, str], ...]
    outputs: tuple[Output, ...]
    table: SampledSignal = field(repr=False, compare=False)
    gain: FloatArray = field(compare=False)
    offset: FloatArray = field(compare=False)
    time_shift: float = 0.0

    def parameters(self) -> tuple[Parameter, ...]:
        """Return gain and offset of every column, and the shift of time."""
        found = []
        for (name, unit), gain, offset in zip(self.columns, self.gain.tolist(), self.offset.tolist(), strict=True):
            text = f"factor on {name}, and on what is made of it"
            found.append(Parameter(f"{name}.gain", gain, "1", text, -_LARGEST, _LARGEST, _CHOICE))
            text = f"added to {name} after the gain"
            found.append(Parameter(f"{name}.offset", offset, unit, text, -_LARGEST, _LARGEST, _CHOICE))
        text = "how much later everything happens than the table says"
        return *found, Parameter(SHIFT, self.time_shift, "s", text, -_LARGEST, _LARGEST, _CHOICE)

    def with_values(self, values: Mapping[str, float]) -> SignalDefinition:
        """Return a copy with some parameters changed; raises ``ParameterError``."""
        known = {p.name: p.value for p in self.parameters()}
        for name, value in values.items():
            if name not in known:
                raise ParameterError(f"parameter '{name}': there is none of this name{hint(name, known)}")
            if not abs(value) <= _LARGEST:
                raise ParameterError(f"parameter '{name}': {value:g} is outside -{_LARGEST:g} ... {_LARGEST:g}")
        wanted = {**known, **values}
        names = [name for name, _ in self.columns]
        gain, offset = (np.array([wanted[f"{n}.{key}"] for n in names]) for key in ("gain", "offset"))
        return replace(self, gain=gain, offset=offset, time_shift=wanted[SHIFT])


def definition_text(
    name: str, title: str, interpolation: str, repeats: bool, columns: Mapping[str, str], outputs: tuple[Output, ...]
) -> str:
    """Return a definition as a file has it; its table lies beside it."""
    lines = [f"{key} = {json.dumps(text)}" for key, text in (("name", name), ("title", title), ("type", "signal"))]
    lines += [f"interpolation = {json.dumps(interpolation)}", f"repeats = {json.dumps(repeats)}"]
    for column, unit in columns.items():
        lines += ["", "[[column]]", f"name = {json.dumps(column)}", f"unit = {json.dumps(unit)}"]
    names = list(columns)
    for made in (o for o in outputs if o.kind != "value"):
        lines += ["", "[[made]]", f"name = {json.dumps(made.name)}", f"unit = {json.dumps(made.unit)}"]
        lines += [f"of = {json.dumps(names[made.column])}", f"kind = {json.dumps(made.kind)}"]
    return "\n".join(lines) + "\n"


def load_signals(path: Path) -> SignalDefinition:
    """Read a definition and the table beside it; raises ``DefinitionError``."""
    table = Table.load(path)
    table.text("type", choices=("signal",))
    name, title = table.text("name"), table.text("title", default="")
    interpolation = table.text("interpolation", choices=INTERPOLATIONS)
    repeats = table.flag("repeats", default=False)
    columns = tuple((t.text("name"), t.text("unit")) for t in table.tables("column"))
    names = [column for column, _ in columns]
    kinds: dict[str, Kind] = {"rate": "rate", "integral": "integral"}
    made = [
        (t.text("name"), t.text("unit"), t.text("of", choices=names), t.text("kind", choices=kinds))
        for t in table.tables("made")
    ]
    table.finish()
    numbers = np.frombuffer(path.with_name(TABLE_FILE).read_bytes(), NUMBERS)
    rows = numbers.reshape(-1, 1 + len(columns)).astype(np.float64)
    outputs = (
        *(Output(n, u, k, "value") for k, (n, u) in enumerate(columns)),
        *(Output(n, u, names.index(of), kinds[kind]) for n, u, of, kind in made),
    )
    signal = SampledSignal(rows[:, 0].copy(), rows[:, 1:], interpolation, repeats)
    count = len(columns)
    return SignalDefinition(
        name, title, interpolation, repeats, columns, outputs, signal, np.ones(count), np.zeros(count)
    )
