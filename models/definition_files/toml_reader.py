"""Read definition files: values with unit and source, with every mistake reported at once.

A definition (of a line, a pantograph, a mechanism) is a TOML file in which a physical value has its unit and its
source::

    tension = [20, "kN", "Table 5.2"]
    encumbrance = [1.2, "m", "choice: gives the printed first dropper"]

A source that begins with ``choice`` marks a value that the data leave open.

The file is longer than others because a table of the file and all that may be wrong with an entry stand together.
"""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from models.definition_files.message_text import hint, nearest, not_utf8, one_line, said, shown_value
from models.definition_files.si_units import shown, to_si

#: Largest number of problems listed.
_MOST: Final = 100
#: A number in the text of a problem, or a list of them.
_NUMBER: Final = re.compile(r"[-+]?\d[\d.e+-]*(, [-+]?\d[\d.e+-]*)*")
#: Deepest allowed nesting of tables and lists; a definition needs five levels.
_DEEPEST: Final = 20
#: Limits of magnitude in SI: no quantity of a line or pantograph lies beyond, and squares and quotients stay finite.
LARGEST: Final = 1e15
SMALLEST: Final = 1e-15


def beyond_all(value: float) -> str:
    """Return why a value in SI cannot belong to anything here, empty if it can."""
    if not abs(value) <= LARGEST:
        return f"is not finite, or larger than anything here can be ({LARGEST:g})"
    return ""


def in_its_unit(unit: str) -> str:
    """Return advice on a value out of range: most such values are in the wrong unit."""
    return "" if unit == "1" else ": check its size and its unit"


@dataclass(frozen=True)
class Problem:
    """A mistake in a definition: where it is, what is wrong, what to do."""

    file: str
    key: str
    text: str

    def __str__(self) -> str:
        parts = (self.file, self.key, self.text) if self.key else (self.file, self.text)
        return ": ".join(map(one_line, parts))


class DefinitionError(ValueError):
    """A definition that cannot be used; the message lists every problem, one per line."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        lines = [str(p) for p in self.problems[:_MOST]]
        if len(self.problems) > _MOST:
            lines.append(f"... and {len(self.problems) - _MOST} more problems")
        super().__init__("\n".join(lines))


@dataclass(frozen=True)
class Quantity:
    """A value as written in a definition, with its source.

    Attributes
    ----------
    value : float or tuple of float
        The number(s) as written.
    unit : str
        The unit as written.
    source : str
        Table, figure or norm; ``choice: why`` where the data leaves it open.
    """

    value: float | tuple[float, ...]
    unit: str
    source: str

    @property
    def is_choice(self) -> bool:
        """Return whether the value was chosen because no source states it."""
        return self.source.startswith("choice")


@dataclass
class _Log:
    file: str
    problems: list[Problem] = field(default_factory=list)
    provenance: dict[str, Quantity] = field(default_factory=dict)


class Table:
    """One table of a definition file, read key by key.

    Reading collects problems instead of stopping; ``finish`` on the root adds unknown keys and raises them all. A value
    that cannot be read is returned as its ``default`` (or as NaN, or empty), so that reading continues.
    """

    def __init__(self, data: dict[str, Any], log: _Log, path: str = "") -> None:
        self._data = data
        self._log = log
        self._path = path
        self._known: set[str] = set()
        self._children: list[Table] = []

    @classmethod
    def load(cls, path: Path) -> Table:
        """Read a TOML file.

        Raises
        ------
        DefinitionError
            If the file is missing, not UTF-8 or not TOML (with the line).
        """
        name = str(path)
        try:
            data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        except FileNotFoundError as error:
            text = "there is no such file; a definition of the library is called by its name, without .toml"
            raise DefinitionError([Problem(name, "", text)]) from error
        except OSError as error:
            raise DefinitionError([Problem(name, "", f"cannot be read ({said(error)})")]) from error
        except UnicodeDecodeError as error:
            raise DefinitionError([Problem(name, "", not_utf8(error))]) from error
        except RecursionError as error:
            raise _too_deep(name) from error
        except ValueError as error:  # TOMLDecodeError, and whole numbers of thousands of digits
            advice = _toml_advice(path, str(error))
            raise DefinitionError([Problem(name, "", f"is not TOML: {error}{advice}")]) from error
        if _is_deep(data):
            raise _too_deep(name)
        return cls(data, _Log(name))

    @classmethod
    def from_dict(cls, data: dict[str, Any], name: str = "definition") -> Table:
        """Wrap an already parsed mapping; ``name`` stands for the file in messages."""
        return cls(data, _Log(name))

    @property
    def provenance(self) -> dict[str, Quantity]:
        """Return every quantity read so far as written, by its dotted key."""
        return self._log.provenance

    @property
    def data(self) -> dict[str, Any]:
        """Return the mapping that the table was made from."""
        return self._data

    @property
    def file(self) -> str:
        """Return the name of the file, for messages."""
        return self._log.file

    def key(self, name: str) -> str:
        """Return the dotted path of ``name`` in this table."""
        return f"{self._path}.{name}" if self._path else name

    def has(self, name: str) -> bool:
        """Return whether the table has a key."""
        return name in self._data

    def offers(self, name: str) -> bool:
        """Return whether the table has a key that it may have: one of those that messages list."""
        self._known.add(name)
        return name in self._data

    def mistaken(self, names: Iterable[str]) -> set[str]:
        """Return those of some keys with which a problem has been recorded."""
        found = {p.key for p in self._log.problems}
        return {name for name in names if self.key(name) in found}

    def comma_advice(self, name: str) -> str:
        """Return advice if a list of numbers looks as if one had a decimal comma, ``[45.0, 45,5, 49.5]``."""
        entry = self._data.get(name)
        values = entry[0] if isinstance(entry, list) and entry and isinstance(entry[0], list) else []
        for a, b in pairwise(values):
            if type(a) is int and type(b) is int and 0 < b < 10 <= a:
                return f"; has '{a},{b}' a decimal comma? write {a}.{b}"
        return ""

    def names(self) -> tuple[str, ...]:
        """Return the keys, in the order of the file."""
        return tuple(self._data)

    def accept_all(self) -> None:
        """Accept every key, in a table whose keys mean nothing until a mistake in it is corrected."""
        self._known.update(self._data)

    def problem(self, name: str, text: str) -> None:
        """Record a problem with the key ``name``."""
        self._log.problems.append(Problem(self._log.file, self.key(name) if name else self._path, text))

    def quantity(
        self,
        name: str,
        unit: str,
        *,
        default: float | None = None,
        minimum: float = -math.inf,
        maximum: float = math.inf,
        positive: bool = False,
    ) -> float:
        """Read ``name = [value, "unit", "source"]`` and return it in the SI unit ``unit``.

        Parameters
        ----------
        default : float, optional
            Returned when the key is absent; without it the key is required.
        minimum, maximum : float
            Allowed range, in SI.
        positive : bool
            Whether the value must be greater than zero.
        """
        entry = self._entry(name, required=default is None)
        if entry is None:
            return math.nan if default is None else default
        values = self._numbers(name, entry, unit, length=1)
        if values is None:
            return math.nan if default is None else default
        self._check_range(name, values, unit, minimum, maximum, positive)
        return values[0]

    def quantities(
        self,
        name: str,
        unit: str,
        *,
        length: int | None = None,
        default: Sequence[float] | None = None,
        minimum: float = -math.inf,
        maximum: float = math.inf,
        positive: bool = False,
    ) -> tuple[float, ...]:
        """Read ``name = [[v1, v2, ...], "unit", "source"]`` and return the values in SI."""
        fallback = tuple(default) if default is not None else (math.nan,) * (length or 0)
        entry = self._entry(name, required=default is None)
        if entry is None:
            return fallback
        values = self._numbers(name, entry, unit, length=length, many=True)
        if values is None:
            return fallback
        self._check_range(name, values, unit, minimum, maximum, positive)
        return values

    def integer(self, name: str, *, default: int | None = None, minimum: int = 0, maximum: int = 10**6) -> int:
        """Read a whole number (a plain one, or ``[n, "1", "source"]``)."""
        entry = self._entry(name, required=default is None)
        fallback = default if default is not None else minimum
        if entry is None:
            return fallback
        value = entry
        if isinstance(entry, list):
            numbers = self._numbers(name, entry, "1", length=1)
            if numbers is None:
                return fallback
            value = int(numbers[0]) if numbers[0].is_integer() else numbers[0]
        if isinstance(value, bool) or not isinstance(value, int):
            self.problem(name, f"{shown_value(value)} is not a whole number")
            return fallback
        if not minimum <= value <= maximum:
            self.problem(name, f"{shown_value(value)} is outside {minimum} ... {maximum}")
            return fallback
        return value

    def text(self, name: str, *, default: str | None = None, choices: Iterable[str] | None = None) -> str:
        """Read a string, if ``choices`` is given one of them."""
        entry = self._entry(name, required=default is None)
        if entry is None:
            return default or ""
        if not isinstance(entry, str):
            self.problem(name, f"{shown_value(entry)} is not a text in quotation marks")
            return default or ""
        allowed = list(choices) if choices is not None else None
        if allowed is not None and entry not in allowed:
            self.problem(name, f"'{entry}' is none of {', '.join(allowed)}{hint(entry, allowed)}")
        return entry

    def texts(self, name: str) -> tuple[str, ...]:
        """Read a list of strings, empty if it is absent."""
        entry = self._entry(name, required=False)
        if entry is None:
            return ()
        if not isinstance(entry, list) or not all(isinstance(e, str) for e in entry):
            self.problem(name, f"{shown_value(entry)} is not a list of texts in quotation marks")
            return ()
        return tuple(entry)

    def flag(self, name: str, *, default: bool | None = None) -> bool:
        """Read ``true`` or ``false``."""
        entry = self._entry(name, required=default is None)
        if entry is None:
            return bool(default)
        if not isinstance(entry, bool):
            self.problem(name, f"{shown_value(entry)} is neither true nor false")
            return bool(default)
        return entry

    def table(self, name: str) -> Table | None:
        """Return the sub-table ``[name]``, None if it is absent."""
        entry = self._entry(name, required=False)
        if entry is None:
            return None
        if not isinstance(entry, dict):
            self.problem(name, f"must be a table [{self.key(name)}]")
            return None
        return self._child(entry, self.key(name))

    def required_table(self, name: str) -> Table:
        """Return the sub-table ``[name]``; report it and return an empty table if it is absent."""
        table = self.table(name)
        if table is None:
            if name not in self._data:
                self.problem(name, f"table [{self.key(name)}] is missing")
            table = Table({}, _Log(self._log.file), self.key(name))  # with a separate log, as one message is enough
        return table

    def tables(self, name: str) -> list[Table]:
        """Return the array of tables ``[[name]]``, empty if absent."""
        entry = self._entry(name, required=False)
        if entry is None:
            return []
        if not isinstance(entry, list) or not all(isinstance(e, dict) for e in entry):
            self.problem(name, f"must be an array of tables [[{self.key(name)}]]")
            return []
        return [self._child(e, f"{self.key(name)}[{i}]") for i, e in enumerate(entry, 1)]

    def finish(self) -> None:
        """Report keys that were not read, and raise if there was any problem.

        Raises
        ------
        DefinitionError
            With every problem of the file.
        """
        self._report_unknown()
        if self._log.problems:
            raise DefinitionError(_once(self._log.problems))

    def _child(self, data: dict[str, Any], path: str) -> Table:
        child = Table(data, self._log, path)
        self._children.append(child)
        return child

    def _entry(self, name: str, *, required: bool) -> Any:
        self._known.add(name)
        if name not in self._data:
            if required:
                self.problem(name, "is missing")
            return None
        return self._data[name]

    def _numbers(
        self, name: str, entry: Any, unit: str, *, length: int | None, many: bool = False
    ) -> tuple[float, ...] | None:
        form = "[[v1, v2, ...]" if many else "[value"
        if not (isinstance(entry, list) and len(entry) == 3 and all(isinstance(e, str) for e in entry[1:])):
            self.problem(
                name, f'{shown_value(entry)} must be written {form}, "unit", "source"]{_two_numbers_advice(entry)}'
            )
            return None
        raw, written_unit, source = entry
        if not source.strip():
            self.problem(name, "names no source; where none states the value, write 'choice: why'")
        values = raw if many and isinstance(raw, list) else [raw]
        if wrong := [v for v in values if not isinstance(v, (int, float)) or isinstance(v, bool)]:
            self.problem(name, f"{shown_value(wrong[0])} is not a number{_text_advice(wrong[0])}")
            return None
        if self._has_absurd(name, values):
            return None
        if length is not None and len(values) != length:
            self.problem(name, f"has {len(values)} values where {length} are needed")
            return None
        try:
            converted = tuple(to_si(float(v), written_unit, unit) for v in values)
        except ValueError as error:
            self.problem(name, str(error))
            return None
        if self._has_absurd(name, converted):
            return None
        written = tuple(float(v) for v in values) if many else float(values[0])
        self._log.provenance[self.key(name)] = Quantity(written, written_unit, source)
        return converted

    def _has_absurd(self, name: str, values: Sequence[float]) -> bool:
        for value in values:
            if text := beyond_all(value):
                self.problem(name, f"{shown_value(value)} {text}")
                return True
        return False

    def _check_range(
        self, name: str, values: tuple[float, ...], unit: str, minimum: float, maximum: float, positive: bool
    ) -> None:
        for value in values:
            if positive and value < SMALLEST:
                self.problem(name, f"{shown(value, unit)} must be greater than 0")
            elif not minimum <= value <= maximum:
                text = f"{shown(value, unit)} is outside {minimum:g} ... {shown(maximum, unit)}"
                self.problem(name, text + in_its_unit(unit))

    def _report_unknown(self) -> None:
        for name in self._data:
            if name not in self._known:
                known, absent = ", ".join(sorted(self._known)) or "none", self._known - set(self._data)
                self.problem(name, f"unknown key (known here: {known}){hint(name, absent)}")
                self._forget_missing(nearest(name, absent))
        for child in self._children:
            child._report_unknown()

    def _forget_missing(self, names: Iterable[str]) -> None:
        """Take back that keys are missing, where a mistyped one has been reported for them."""
        keys = {self.key(name) for name in names}
        self._log.problems[:] = [p for p in self._log.problems if not (p.key in keys and p.text.endswith("is missing"))]


def _once(problems: Iterable[Problem]) -> list[Problem]:
    """Return every problem once: a rule is read for every span, and reports its mistakes for every span."""
    alike: dict[tuple[str, str], list[Problem]] = {}
    for problem in dict.fromkeys(problems):
        alike.setdefault((problem.key, _NUMBER.sub("0", problem.text)), []).append(problem)
    return [
        first if not others else dataclasses.replace(first, text=f"{first.text} (and {len(others)} more like this)")
        for first, *others in alike.values()
    ]


def _text_advice(value: Any) -> str:
    """Return advice if a number is written as a text, ``"22,5"``."""
    number = value.strip().replace(",", ".") if isinstance(value, str) else ""
    return f"; write {number}, without quotation marks" if re.fullmatch(r"[-+]?\d+(\.\d*)?", number) else ""


def _two_numbers_advice(entry: Any) -> str:
    """Return advice if an entry is ``[20,5, "kN", "source"]``, which is read as two numbers."""
    commas = isinstance(entry, list) and len(entry) == 4 and all(type(e) is int for e in entry[:2])
    return f"; has it a decimal comma? write {entry[0]}.{entry[1]}" if commas else ""


def _toml_advice(path: Path, error: str) -> str:
    """Return advice if the line with the mistake has what looks like a decimal comma."""
    number = re.search(r"at line (\d+)", error)
    line = path.read_text(encoding="utf-8-sig").splitlines()[int(number[1]) - 1] if number else ""
    return f"; does '{line.strip()}' have a decimal comma? write a point" if re.search(r"\d,\d", line) else ""


def _too_deep(file: str) -> DefinitionError:
    return DefinitionError([Problem(file, "", f"is not a definition: it is nested more than {_DEEPEST} levels")])


def _is_deep(data: Any) -> bool:
    """Return whether values are nested deeper than allowed, found without recursion."""
    level = [data]
    for _ in range(_DEEPEST):
        inner = [v.values() if isinstance(v, dict) else v for v in level if isinstance(v, (dict, list))]
        level = [v for values in inner for v in values]
    return bool(level)
