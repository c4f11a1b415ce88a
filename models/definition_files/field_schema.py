"""Frozen dataclasses whose fields know their unit, range and meaning.

One declaration serves three readers: the definition file is checked against it, an FMU shows it as a
parameter, and a report prints it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from models.definition_files.parameter import Parameter, ParameterError
from models.definition_files.si_units import shown
from models.definition_files.toml_reader import SMALLEST, Quantity, Table, beyond_all, in_its_unit

_META = "openpanto"
T = TypeVar("T")


@dataclass(frozen=True)
class _Spec:
    unit: str
    description: str
    minimum: float
    maximum: float
    positive: bool
    integer: bool
    tunable: bool


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
    """Declare a physical value of a dataclass; ``default=None`` makes it optional without a value."""
    spec = _Spec(unit, description, minimum, maximum, positive, integer=False, tunable=tunable)
    return dataclasses.field(default=default, metadata={_META: spec})


def count(description: str, *, default: Any = dataclasses.MISSING, minimum: int = 0, maximum: int = 10**6) -> Any:
    """Declare a whole number of a dataclass."""
    spec = _Spec("1", description, minimum, maximum, positive=False, integer=True, tunable=True)
    return dataclasses.field(default=default, metadata={_META: spec})


def monitoring() -> Any:
    """Declare the number of a definition that says whether the balance is kept."""
    return count("whether the energy balance is kept, for energy.* and contact.work: 0 no, 1 yes", default=0, maximum=1)


def read(cls: type[T], table: Table, **given: Any) -> T:
    """Fill a dataclass from a table; fields without a declared quantity come from ``given``."""
    values = dict(given)
    for name, spec, default in _specs(cls):
        if name in values:
            continue
        values[name] = _read_one(table, name, spec, default)
    return cls(**values)


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
        value = getattr(obj, field.name)
        name = f"{prefix}.{field.name}" if prefix else field.name
        spec = field.metadata.get(_META)
        if spec is not None and spec.tunable and value is not None:
            yield _parameter(name, value, spec, provenance)
        elif dataclasses.is_dataclass(value):
            yield from parameters(value, provenance, name)
        elif isinstance(value, tuple):
            for index, item in enumerate(value, 1):
                if dataclasses.is_dataclass(item):
                    yield from parameters(item, provenance, f"{name}[{index}]")


def with_values(obj: T, values: Mapping[str, float]) -> T:
    """Return a copy of a dataclass with the numbers at dotted names replaced.

    Raises
    ------
    ParameterError
        If a name is unknown or a value not finite, not whole where it must be, or out of range.
    """
    for name, value in values.items():
        obj = _replaced(obj, name.split("."), name, value)
    return obj


def _specs(cls: type[Any]) -> Iterator[tuple[str, _Spec, Any]]:
    for field in dataclasses.fields(cls):
        spec = field.metadata.get(_META)
        if spec is not None:
            yield field.name, spec, field.default


def _read_one(table: Table, name: str, spec: _Spec, default: Any) -> float | int | None:
    if default is None and not table.has(name):
        return None
    fallback = None if default in (dataclasses.MISSING, None) else default
    if spec.integer:
        return table.integer(name, default=fallback, minimum=int(spec.minimum), maximum=int(spec.maximum))
    return table.quantity(
        name, spec.unit, default=fallback, minimum=spec.minimum, maximum=spec.maximum, positive=spec.positive
    )


def _parameter(name: str, value: float, spec: _Spec, provenance: Mapping[str, Quantity]) -> Parameter:
    origin = provenance.get(name)
    return Parameter(
        name=name,
        value=float(value),
        unit=spec.unit,
        description=spec.description,
        minimum=spec.minimum if math.isfinite(spec.minimum) else (0.0 if spec.positive else None),
        maximum=spec.maximum if math.isfinite(spec.maximum) else None,
        source=origin.source if origin is not None else "choice: default",
        is_integer=spec.integer,
    )


def _replaced(obj: Any, path: list[str], name: str, value: float) -> Any:
    key, index = _indexed(path[0])
    fields = {f.name: f for f in dataclasses.fields(obj)} if dataclasses.is_dataclass(obj) else {}
    if key not in fields:
        raise ParameterError(f"parameter '{name}': there is none of this name")
    if len(path) > 1:
        return dataclasses.replace(obj, **{key: _replaced_inside(getattr(obj, key), index, path, name, value)})
    spec = fields[key].metadata.get(_META)
    if spec is None or index is not None:
        raise ParameterError(f"parameter '{name}': is not a number that can be set")
    _check(name, value, spec)
    return dataclasses.replace(obj, **{key: int(value) if spec.integer else float(value)})


def _replaced_inside(inner: Any, index: int | None, path: list[str], name: str, value: float) -> Any:
    if index is None:
        return _replaced(inner, path[1:], name, value)
    if not isinstance(inner, tuple) or not 1 <= index <= len(inner):
        raise ParameterError(f"parameter '{name}': there is none of this name")
    changed = list(inner)
    changed[index - 1] = _replaced(inner[index - 1], path[1:], name, value)
    return tuple(changed)


def _indexed(key: str) -> tuple[str, int | None]:
    """Split ``stage[2]`` into its name and number."""
    name, bracket, rest = key.partition("[")
    number = rest[:-1]
    is_index = bracket and rest.endswith("]") and number.isascii() and number.isdigit() and len(number) <= 9
    return (name, int(number)) if is_index else (key, None)


def _check(name: str, value: float, spec: _Spec) -> None:
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
