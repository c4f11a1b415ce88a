"""The JSON files of a results folder, read back: either in the shape in which they are used, or a message."""

from __future__ import annotations

import functools
import json
from dataclasses import fields
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from master.errors import MasterError, one_line, said
from master.evaluation.en50367_limits import OwnLimits, Supply


class _Loose(BaseModel):
    """Checks only what is computed with; the rest is shown as it is."""

    # Whoever reads nothing back is spared the making of the checks: a run.
    model_config = ConfigDict(extra="allow", strict=True, allow_inf_nan=False, defer_build=True)


class _Contact(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, defer_build=True)

    index: int
    catenary: str
    pantograph: str
    prefix: str
    told: str = ""
    ends: dict[str, str] = {}


class _Interval(_Loose):
    start: float | None = None
    end: float | None = None


class _Coupling(_Loose):
    scheme: str = ""
    order: list[str] = []
    tolerance: float | None = None
    max_iterations: int | None = None
    weight: float | None = None


class _Filter(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)

    kind: Literal["butterworth", "fft"]
    order: int | None = None
    cutoff: float
    phase: Literal["zero", "causal"] | None = None


class _Limits(_Loose):
    supply: Supply = "AC"
    __pydantic_extra__: dict[str, float | None] = Field(init=False)

    @model_validator(mode="after")
    def _only_known(self) -> _Limits:
        if unknown := set(self.__pydantic_extra__) - {f.name for f in fields(OwnLimits)}:
            raise ValueError(f"unknown limit: {', '.join(sorted(unknown))}")
        return self


class _Settings(_Loose):
    start: float | None = None
    stop: float | None = None
    step: float | None = None
    interval: _Interval = Field(default_factory=_Interval)
    filter: _Filter | None = None
    limits: _Limits = Field(default_factory=_Limits)
    coupling: _Coupling = Field(default_factory=_Coupling)


class _Input(_Loose):
    name: str
    unit: str = ""
    description: str = ""
    changed: bool = False


class _Component(_Loose):
    name: str
    fmu: str = ""
    description: str = ""
    sha256: str = ""
    guid: str = ""
    tool: str = ""
    definition: str = ""
    tolerance: float | None = None
    parameters: dict[str, Any] = {}
    inputs: list[_Input] = []


class _Caution(_Loose):
    component: str
    text: str


class _Power(_Loose):
    # Numbers that were not finite are written as null.
    contact: int
    energy: float | None
    transferred: float | None
    rms: float | None


class _Energy(_Loose):
    what: str
    text: str


class _Lateness(_Loose):
    maximum: float


class _Paced(_Loose):
    factor: float
    steps: int
    missed: int
    lateness: _Lateness


class _Performance(_Loose):
    wall_time: float = 0.0
    initialisation_time: float = 0.0
    real_time_factor: float = 0.0
    peak_memory: float = 0.0
    component_time: dict[str, float] = {}
    isolated: bool = False
    real_time: _Paced | None = None


class _Summary(_Loose):
    format: int = 1
    contacts: list[_Contact] = []
    settings: _Settings = Field(default_factory=_Settings)
    components: list[_Component] = []
    warnings: list[_Caution] = []
    adjustments: list[str] = []
    scenario_warnings: list[str] = []
    interface_power: list[_Power] = []
    energy: list[_Energy] = []
    performance: _Performance = Field(default_factory=_Performance)
    versions: dict[str, str] = {}
    scenario: str = ""
    title: str = ""
    status: str = ""
    reason: str = ""
    date: str = ""
    run: str = ""
    time_reached: float | None = None


@functools.cache
def _summary_shape() -> TypeAdapter[Any]:
    return TypeAdapter(_Summary)


@functools.cache
def _geometry_shape() -> TypeAdapter[Any]:
    return TypeAdapter(dict[str, dict[str, float]], config=ConfigDict(strict=True, allow_inf_nan=False))


def read_summary(path: Path) -> dict[str, Any]:
    """Read ``summary.json``; raises `MasterError` if it is not what a run has written."""
    return _read(path, _summary_shape())


def read_geometry(path: Path) -> dict[str, dict[str, float]]:
    """Read ``geometry.json``; raises `MasterError` if it is not what a run has written."""
    return _read(path, _geometry_shape())


def _read(path: Path, shape: TypeAdapter[Any]) -> dict[str, Any]:
    try:
        data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        shape.validate_python(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise MasterError(f"{path} is damaged: {one_line(where)}: {first['msg']}; run the scenario again") from error
    except OSError as error:
        raise MasterError(f"{path} cannot be read ({said(error)})") from error
    except (ValueError, RecursionError) as error:
        raise MasterError(f"{path} is damaged: {one_line(str(error))}; run the scenario again") from error
    return data
