"""Frozen dataclasses whose fields know their unit, range and meaning.

One declaration serves three readers: the definition file is checked against it, an FMU shows it as a parameter, and a
report prints it. A definition declares what it consists of, numbers and the tables that hold them::

    @dataclass(frozen=True, kw_only=True)
    class Line:
        tension: float = quantity("N", "tension", minimum=500.0, maximum=1e5)
        mesh: Mesh = part(Mesh, default=Mesh())                 # [mesh]
        bodies: tuple[Body, ...] = named("body", Body)          # [body.NAME]

and `read` fills it, `parameters` lists its tunable numbers, `with_values` changes them. A key that is a word of Python
has a field with an underscore after it (``from_``). Conditions on more than one field go into a method ``problems()``,
which yields pairs of a key (possibly empty) and a text.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol, TypeVar, runtime_checkable

from models.definition_files.message_text import hint
from models.definition_files.parameter import Parameter, ParameterError
from models.definition_files.si_units import shown
from models.definition_files.toml_reader import SMALLEST, Quantity, Table, beyond_all, in_its_unit

_META = "openpanto"
#: Names of elements: parts of dotted parameter names.
_NAME: Final = re.compile(r"[\w-]+")
XYZ: Final = ("x", "y", "z")
#: Kind of an element -> its class, or what finds that in the element's table.
Kinds = Mapping[str, type[Any] | Callable[[Table], type[Any]]]
T = TypeVar("T")


@runtime_checkable
class Checked(Protocol):
    """A dataclass with values that must fit together."""

    def problems(self) -> Iterable[tuple[str, str]]:
        """Yield the key and the text of every problem."""


class _Spec(Protocol):
    """What a field declares."""

    def read(self, table: Table, name: str, default: Any) -> Any:
        """Read the field from a table."""


@dataclass(frozen=True)
class _Number:
    """A number, or several numbers with labels."""

    unit: str
    description: str
    minimum: float
    maximum: float
    positive: bool = False
    integer: bool = False
    tunable: bool = True
    labels: tuple[str, ...] = ()

    def read(self, table: Table, name: str, default: Any) -> Any:
        if default is None and not table.offers(name):
            return None
        fallback = None if default in (dataclasses.MISSING, None) else default
        if self.integer:
            return table.integer(name, default=fallback, minimum=int(self.minimum), maximum=int(self.maximum))
        limits: dict[str, Any] = {"minimum": self.minimum, "maximum": self.maximum, "positive": self.positive}
        if self.labels:
            return table.quantities(name, self.unit, length=len(self.labels), default=fallback, **limits)
        return table.quantity(name, self.unit, default=fallback, **limits)

    def names(self, name: str) -> tuple[str, ...]:
        """Return the names of the parameters that a field of some name makes."""
        return tuple(f"{name}.{label}" for label in self.labels) or (name,)

    def values(self, value: Any) -> tuple[float, ...]:
        """Return the numbers that a field holds."""
        return tuple(map(float, value)) if self.labels else (float(value),)

    def replaced(self, old: Any, name: str, wanted: str, value: float) -> Any:
        """Return the field's value with one of its numbers replaced."""
        if not self.labels:
            return int(value) if self.integer else float(value)
        return tuple(
            float(value) if n == wanted else component for n, component in zip(self.names(name), old, strict=True)
        )


@dataclass(frozen=True)
class _Direction:
    """A direction in space, kept as a unit vector."""

    def read(self, table: Table, name: str, default: Any) -> Any:
        if default is not dataclasses.MISSING and not table.offers(name):
            return default
        x, y, z = table.quantities(name, "1", length=3)
        length = math.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            table.problem(name, "the axis has no direction: all its components are 0")
            return x, y, z
        return x / length, y / length, z / length


@dataclass(frozen=True)
class _Text:
    """A text, if there are choices one of them."""

    choices: Iterable[str] | None
    filled: bool

    def read(self, table: Table, name: str, default: Any) -> Any:
        if self.filled and table.data.get(name) == "":
            table.problem(name, "is empty")
        return table.text(name, default=None if default is dataclasses.MISSING else default, choices=self.choices)


@dataclass(frozen=True)
class _Part:
    """A dataclass in a sub-table."""

    cls: type[Any]

    def read(self, table: Table, name: str, default: Any) -> Any:
        if default is dataclasses.MISSING:
            return read(self.cls, table.required_table(name))
        inner = table.table(name)
        return default if inner is None else read(self.cls, inner)


@dataclass(frozen=True)
class _Series:
    """A list of numbers of any length, which stay as written."""

    unit: str
    description: str
    minimum: float
    maximum: float

    def read(self, table: Table, name: str, default: Any) -> Any:
        fallback = None if default is dataclasses.MISSING else default
        return table.quantities(name, self.unit, default=fallback, minimum=self.minimum, maximum=self.maximum)


@dataclass(frozen=True)
class _WordOrPart:
    """One of some words, or a dataclass in a sub-table."""

    choices: tuple[str, ...]
    cls: type[Any]

    def read(self, table: Table, name: str, default: Any) -> Any:
        if default is not dataclasses.MISSING and not table.offers(name):
            return default
        given = table.data.get(name)
        if isinstance(given, dict):
            inner = table.table(name)
            return default if inner is None else read(self.cls, inner)
        return table.text(name, choices=self.choices)


@dataclass(frozen=True)
class _Named:
    """Named dataclasses in tables ``[key.NAME]``, whose class may depend on the text ``kind`` in the table."""

    key: str
    kinds: type[Any] | Kinds

    def read(self, table: Table, name: str, default: Any) -> Any:
        every = table.table(self.key)
        if every is None:
            return ()
        for given in every.names():
            if not _NAME.fullmatch(given):
                every.problem(given, "a name is made of letters, digits, '_' and '-'")
        inner = ((given, every.table(given)) for given in every.names())
        read_all = (self._read_one(given, one) for given, one in inner if one is not None)
        return tuple(item for item in read_all if item is not None)

    def _read_one(self, name: str, table: Table) -> Any:
        if isinstance(self.kinds, type):
            return read(self.kinds, table, name=name)
        kind = table.text("kind", choices=self.kinds)
        if kind in self.kinds:
            cls = self.kinds[kind]
            return read(cls if isinstance(cls, type) else cls(table), table, name=name)
        table.accept_all()  # what the other keys mean depends on the kind
        return None


def quantity(
    unit: str,
    description: str,
    *,
    default: Any = dataclasses.MISSING,
    minimum: float = -math.inf,
    maximum: float = math.inf,
    positive: bool = False,
    tunable: bool = True,
) -> Any:
    """Declare a physical value; ``default=None`` makes it optional without a value.

    ``{name}`` in the description stands for the name of the element that has the field.
    """
    return _field(_Number(unit, description, minimum, maximum, positive, tunable=tunable), default)


def vector(
    unit: str,
    description: str,
    *,
    labels: tuple[str, ...] = XYZ,
    default: Any = dataclasses.MISSING,
    minimum: float = -math.inf,
    maximum: float = math.inf,
    tunable: bool = True,
) -> Any:
    """Declare physical values written as one list; they become a tuple, and parameters NAME.LABEL."""
    return _field(_Number(unit, description, minimum, maximum, tunable=tunable, labels=labels), default)


def direction(*, default: Any = dataclasses.MISSING) -> Any:
    """Declare a direction in space, written with any length and stored as a unit vector."""
    return _field(_Direction(), default)


def count(
    description: str,
    *,
    default: Any = dataclasses.MISSING,
    minimum: int = 0,
    maximum: int = 10**6,
    tunable: bool = True,
) -> Any:
    """Declare a whole number."""
    return _field(_Number("1", description, minimum, maximum, integer=True, tunable=tunable), default)


def monitoring() -> Any:
    """Declare the number that switches the energy balance on."""
    return count("whether the energy balance is kept, for energy.* and contact.work: 0 no, 1 yes", default=0, maximum=1)


def text(*, default: Any = dataclasses.MISSING, choices: Iterable[str] | None = None, filled: bool = False) -> Any:
    """Declare a text; where it is ``filled``, an empty one is a mistake."""
    return _field(_Text(choices, filled), default)


def part(cls: type[Any], *, default: Any = dataclasses.MISSING) -> Any:
    """Declare a dataclass in a sub-table; ``default=None`` makes it optional."""
    return _field(_Part(cls), default)


def series(
    unit: str,
    description: str,
    *,
    default: Any = dataclasses.MISSING,
    minimum: float = -math.inf,
    maximum: float = math.inf,
) -> Any:
    """Declare a list of physical values of any length: a column of a table, no parameter."""
    return _field(_Series(unit, description, minimum, maximum), default)


def word_or_part(choices: tuple[str, ...], cls: type[Any], *, default: Any = dataclasses.MISSING) -> Any:
    """Declare one of some words, or a dataclass in a sub-table."""
    return _field(_WordOrPart(choices, cls), default)


def named(key: str, kinds: type[Any] | Kinds) -> Any:
    """Declare tables ``[key.NAME]``: a tuple of dataclasses with a ``name``, of the class given by ``kind``."""
    return _field(_Named(key, kinds), dataclasses.MISSING)


def _field(spec: _Spec, default: Any) -> Any:
    return dataclasses.field(default=default, metadata={_META: spec})


def read(cls: type[T], table: Table, **given: Any) -> T:
    """Read a dataclass from a table; fields without a declaration come from ``given``."""
    values = dict(given)
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        spec: _Spec | None = field.metadata.get(_META)
        if spec is not None and field.name not in values:
            values[field.name] = spec.read(table, _key(field), field.default)
    result = cls(**values)
    if isinstance(result, Checked) and not unread(cls, table):
        mistaken = _mistaken(cls, table)
        for key, problem in result.problems():
            if key not in mistaken:
                table.problem(key, problem)
    return result


def _mistaken(cls: type[Any], table: Table) -> set[str]:
    """Return the fields that could not be read; of a table of columns all of them, which are to fit one another."""
    fields = {_key(f): f.metadata.get(_META) for f in dataclasses.fields(cls)}
    found = table.mistaken(fields)
    is_columns = all(isinstance(spec, _Series) for spec in fields.values())
    return set(fields) if found and is_columns else found


def unread(cls: type[Any], table: Table) -> set[str]:
    """Return the names of elements whose kind is unknown: what seems to be missing may be one of these."""
    named_fields = [f.metadata.get(_META) for f in dataclasses.fields(cls)]
    return {
        name
        for spec in named_fields
        if isinstance(spec, _Named) and not isinstance(spec.kinds, type)
        for name, inner in _tables(table, spec.key)
        if not isinstance(kind := inner.get("kind"), str) or kind not in spec.kinds
    }


def _tables(table: Table, key: str) -> Iterator[tuple[str, dict[str, Any]]]:
    given = table.data.get(key)
    if isinstance(given, dict):
        yield from ((name, inner) for name, inner in given.items() if isinstance(inner, dict))


def parameters(obj: Any, provenance: Mapping[str, Quantity], prefix: str = "") -> Iterator[Parameter]:
    """Yield the tunable numbers of a dataclass and of the dataclasses inside it.

    Parameters
    ----------
    obj : dataclass instance
    provenance : mapping
        Dotted key -> quantity as written, for the sources.
    prefix : str
        Dotted path of ``obj``.
    """
    for field in dataclasses.fields(obj):
        spec, value = field.metadata.get(_META), getattr(obj, field.name)
        if isinstance(spec, _Number):
            if spec.tunable and value is not None:
                description = spec.description.replace("{name}", getattr(obj, "name", ""))
                yield from _listed(_joined(prefix, _key(field)), value, spec, description, provenance)
        else:
            for name, item in _inside(field, value):
                yield from parameters(item, provenance, _joined(prefix, name))


def with_values(obj: T, values: Mapping[str, float]) -> T:
    """Return a copy of a dataclass with the numbers at dotted names replaced.

    Raises
    ------
    ParameterError
        If a name is unknown, a value is not finite, not whole where it must be, or out of range, or if the values do
        not fit together.
    """
    for name, value in values.items():
        changed = _replaced(obj, name, name, value)
        if changed is None:
            near = hint(name, (p.name for p in parameters(obj, {})), most=3)
            raise ParameterError(f"parameter '{name}': there is none of this name{near}")
        obj = changed
    if found := [": ".join(filter(None, problem)) for problem in _problems(obj) if values]:
        raise ParameterError("\n".join(found))
    return obj


def _key(field: dataclasses.Field[Any]) -> str:
    """Return the key of a field; no key ends with an underscore."""
    return field.name.rstrip("_")


def _joined(*names: str) -> str:
    return ".".join(filter(None, names))


def _inside(field: dataclasses.Field[Any], value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the dataclasses in a field with their dotted names: one, numbered ones or named ones."""
    spec = field.metadata.get(_META)
    if dataclasses.is_dataclass(value):
        yield field.name, value
    elif isinstance(spec, _Named):
        yield from ((f"{spec.key}.{item.name}", item) for item in value)
    elif isinstance(value, tuple):
        numbered = ((f"{field.name}[{index}]", item) for index, item in enumerate(value, 1))
        yield from ((name, item) for name, item in numbered if dataclasses.is_dataclass(item))


def _problems(obj: Any, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield the problems of a dataclass and of those inside it, with dotted keys."""
    if isinstance(obj, Checked):
        yield from ((_joined(prefix, key), problem) for key, problem in obj.problems())
    for field in dataclasses.fields(obj):
        for name, item in _inside(field, getattr(obj, field.name)):
            yield from _problems(item, _joined(prefix, name))


def _listed(
    name: str, value: Any, spec: _Number, description: str, provenance: Mapping[str, Quantity]
) -> Iterator[Parameter]:
    """Yield the parameters of one field."""
    origin = provenance.get(name)
    for full, label, number in zip(spec.names(name), spec.labels or ("",), spec.values(value), strict=True):
        yield Parameter(
            name=full,
            value=number,
            unit=spec.unit,
            description=f"{description}, {label}" if label else description,
            minimum=spec.minimum if math.isfinite(spec.minimum) else (0.0 if spec.positive else None),
            maximum=spec.maximum if math.isfinite(spec.maximum) else None,
            source=origin.source if origin is not None else "choice: default",
            is_integer=spec.integer,
        )


def _replaced(obj: Any, path: str, name: str, value: float) -> Any:
    """Return a dataclass with the number at a dotted path replaced, None if there is none; ``name`` is all of it."""
    for field in dataclasses.fields(obj):
        spec, old = field.metadata.get(_META), getattr(obj, field.name)
        if isinstance(spec, _Number):
            if path in spec.names(_key(field)) and not (spec.labels and old is None):
                _check(name, value, spec)
                return dataclasses.replace(obj, **{field.name: spec.replaced(old, _key(field), path, value)})
            continue
        for index, (inner, item) in enumerate(_inside(field, old)):
            if path.startswith(f"{inner}."):
                new = _replaced(item, path[len(inner) + 1 :], name, value)
                if new is None:
                    return None
                if isinstance(old, tuple):
                    new = (*old[:index], new, *old[index + 1 :])
                return dataclasses.replace(obj, **{field.name: new})
    if any(path == _key(field) for field in dataclasses.fields(obj)):
        raise ParameterError(f"parameter '{name}': is not a number that can be set")
    return None


def _check(name: str, value: float, spec: _Number) -> None:
    if text := beyond_all(value):
        raise ParameterError(f"parameter '{name}': {value:g} {text}")
    if spec.integer and not float(value).is_integer():
        raise ParameterError(f"parameter '{name}': {value:g} is not a whole number")
    if spec.positive and value < SMALLEST:
        raise ParameterError(f"parameter '{name}': {shown(value, spec.unit)} must be greater than 0")
    if not spec.minimum <= value <= spec.maximum:
        raise ParameterError(
            f"parameter '{name}': {shown(value, spec.unit)} is outside {spec.minimum:g} ... "
            f"{shown(spec.maximum, spec.unit)}{in_its_unit(spec.unit)}"
        )
