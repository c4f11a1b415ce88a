"""The recipe of a signal FMU: a table over time in a CSV file, and what is to be made of its columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fmus.builder.recipe import BuildError, Recipe
from models.definition_files.message_text import hint
from models.numerics.sampled_signal import HELD, LINEAR
from models.signals.signal_definition import NUMBERS, SHIFT, TABLE_FILE, Kind, Output, definition_text
from models.signals.signal_reading import VARIABLE, SignalFileError, SignalTable, read_signals

_NAME = re.compile(r"[A-Za-z0-9_]+")


@dataclass(frozen=True)
class SignalRequest:
    """What is asked for.

    Attributes
    ----------
    file : Path
    name : str or None
        What follows ``Signal_`` in the FMU's name; the file's by default.
    time : str or None
        Column of the times; the first one by default.
    interpolation : str
    rates, integrals : sequence of str
        ``COLUMN=NAME``: the name of the output that is the column's rate or integral.
    repeats : bool
    """

    file: Path
    name: str | None = None
    time: str | None = None
    interpolation: str = LINEAR
    rates: Sequence[str] = field(default=())
    integrals: Sequence[str] = field(default=())
    repeats: bool = False


def signal_recipe(wanted: SignalRequest) -> Recipe:
    """Return how to make a signal FMU.

    Raises
    ------
    BuildError
        If the file is no table of signals, or what is asked for cannot be made of it.
    """
    name = wanted.name or wanted.file.stem
    if not _NAME.fullmatch(name):
        raise BuildError(f"'{name}' is no name for an FMU: letters, digits and _ are; give one by --name")
    try:
        table = read_signals(wanted.file, wanted.time)
    except SignalFileError as error:
        raise BuildError(str(error)) from error
    outputs = _outputs(wanted, table)
    title = f"Signals from {wanted.file.name}"
    columns = dict(zip(table.names, table.units, strict=True))
    text = definition_text(name, title, wanted.interpolation, wanted.repeats, columns, outputs)
    data = np.column_stack([table.time, table.values]).astype(NUMBERS).tobytes()
    return Recipe(
        f"Signal_{name}",
        title,
        "fmus.slave.signal_slave",
        "SignalSlave",
        wanted.file,
        text=text.encode(),
        resources={TABLE_FILE: data},
    )


def end_doubt(wanted: SignalRequest, table: SignalTable | None = None) -> str:
    """Return what deserves a second look in a table that repeats itself: a jump where it begins again."""
    if not wanted.repeats:
        return ""
    table = read_signals(wanted.file, wanted.time) if table is None else table
    jumps = np.abs(table.values[-1] - table.values[0]) > 1e-3 * np.ptp(table.values, axis=0)
    names = [name for name, jump in zip(table.names, jumps.tolist(), strict=True) if jump]
    if not names:
        return ""
    return f"{', '.join(names)} jump where the table begins again: its last row is not its first"


def _outputs(wanted: SignalRequest, table: SignalTable) -> tuple[Output, ...]:
    outputs = [Output(n, u, k, "value") for k, (n, u) in enumerate(zip(table.names, table.units, strict=True))]
    asked: list[tuple[str, Kind]] = [*((t, "rate") for t in wanted.rates), *((t, "integral") for t in wanted.integrals)]
    for text, kind in asked:
        column, _, name = text.partition("=")
        if not VARIABLE.fullmatch(name):
            raise BuildError(f"--{kind} {text}: write COLUMN=NAME, such as base.z=base.vz")
        if column not in table.names:
            raise BuildError(f"--{kind} {text}: {wanted.file} has no column '{column}'{hint(column, table.names)}")
        if name in (o.name for o in outputs):
            raise BuildError(f"--{kind} {text}: there is an output '{name}' already")
        if kind == "rate" and wanted.interpolation == HELD:
            raise BuildError(f"--rate {text}: values that are held have none; take --interpolation linear or smooth")
        place = table.names.index(column)
        unit = table.units[place]
        outputs.append(Output(name, rate_unit(unit) if kind == "rate" else integral_unit(unit), place, kind))
    parameters = {SHIFT, *(f"{column}.{key}" for column in table.names for key in ("gain", "offset"))}
    if taken := [o.name for o in outputs if o.name in parameters]:
        raise BuildError(
            f"{wanted.file}: '{taken[0]}' is the name of a parameter of the FMU; give the output another one"
        )
    return tuple(outputs)


def rate_unit(unit: str) -> str:
    """Return the unit of the rate of what has a unit.

    Examples
    --------
    >>> [rate_unit(u) for u in ("m", "m/s", "m/s2", "1", "N", "N.s/m", "1/s")]
    ['m/s', 'm/s2', 'm/s3', '1/s', 'N/s', 'N/m', '1/s2']
    """
    above, *below = unit.split("/")
    factors = above.split(".")
    if "s" in factors:
        factors.remove("s")
        return "/".join([".".join(factors) or "1", *below])
    for k, part in enumerate(below):
        if match := re.fullmatch(r"s(\d*)", part):
            below[k] = f"s{int(match[1] or 1) + 1}"
            return "/".join([above, *below])
    return "/".join([above, *below, "s"])


def integral_unit(unit: str) -> str:
    """Return the unit of the integral over time of what has a unit.

    Examples
    --------
    >>> [integral_unit(u) for u in ("m", "m/s", "m/s2", "1", "N", "1/s", "N/m")]
    ['m.s', 'm', 'm/s', 's', 'N.s', '1', 'N.s/m']
    """
    above, *below = unit.split("/")
    for k, part in enumerate(below):
        if match := re.fullmatch(r"s(\d*)", part):
            power = int(match[1] or 1) - 1
            below[k : k + 1] = [] if power == 0 else ["s" if power == 1 else f"s{power}"]
            return "/".join([above, *below])
    return "/".join(["s" if above == "1" else f"{above}.s", *below])
