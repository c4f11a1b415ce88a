"""Run settings that SSP has no place for, in an annotation that other tools skip.

The annotation stands in the ``ssd:Annotations`` of the system structure description::

    <ssc:Annotation type="urn:openpanto:ssp">
      <panto:Run xmlns:panto="urn:openpanto:ssp">
        <panto:Coupling scheme="jacobi"/>
        <panto:Interval start="551" end="798" until="end"/>
        <panto:Filter kind="butterworth" order="6" cutoff="20" phase="zero"/>
        <panto:Limits supply="AC" maximum="300"/>
        <panto:Calibration parameter="pantograph.static_force" meanForce="157.5" tolerance="0.1"/>
        <panto:Record variables="catenary.dropper[*].force" every="0.005"/>
      </panto:Run>
    </ssc:Annotation>

Everything is optional. The macro step is read from ``osp:FixedStepAlgorithm``, which libcosim reads too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

from lxml import etree
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from master.errors import hint
from master.ssp.ssm import NOTE, several
from master.ssp.ssp_xml import SSC, Reader, children, elements, namespace, tag

NAMESPACE: Final = "urn:openpanto:ssp"
OSP_TYPE: Final = "com.opensimulationplatform"

Scheme = Literal["jacobi", "gauss-seidel", "iterative"]
SCHEMES: Final[tuple[Scheme, ...]] = get_args(Scheme)
#: Options of each scheme: the settings of `Coupling` that it uses. `coupling_schemes` makes it with these alone, and
#: the summary, comparisons and checkpoints show these alone.
OPTIONS: Final[dict[Scheme, tuple[str, ...]]] = {
    "jacobi": (),
    "gauss-seidel": ("order",),
    "iterative": ("tolerance", "max_iterations", "weight"),
}


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Coupling(_Settings):
    """How the components exchange values.

    Attributes
    ----------
    scheme : str
        jacobi, gauss-seidel or iterative.
    order : tuple of str
        Components in the order in which gauss-seidel steps them; empty: as in the SSD.
    tolerance : float
        iterative: largest relative change of an exchanged value that counts as settled.
    max_iterations : int
        iterative: repetitions of a step before the run stops with an error.
    weight : float
        iterative: weight of the step's end in what the components receive (`coupling_schemes.Iterative`).
    """

    scheme: Scheme = "jacobi"
    order: tuple[str, ...] = ()
    tolerance: float = Field(1e-8, gt=0)
    max_iterations: int = Field(50, ge=2, alias="maxIterations")
    weight: float = Field(1.0, gt=0, le=1)

    @property
    def options(self) -> dict[str, Any]:
        """Return the options of the scheme, by name."""
        return {name: getattr(self, name) for name in OPTIONS[self.scheme]}


class EvaluationInterval(_Settings):
    """Interval of interest along the track [m]; from where the contact has settled and to the end, if not given.

    ``until="end"`` lets the run last until the last pantograph has left the interval, whatever stop time the scenario
    has for other tools; ``until="stop"`` until the stop time. Not given, it is the stop time if there is one.
    """

    start: float | None = None
    end: float | None = None
    until: Literal["stop", "end"] | None = None

    @model_validator(mode="after")
    def _ordered(self) -> EvaluationInterval:
        if self.start is not None and self.end is not None and self.start >= self.end:
            raise ValueError(f"start {self.start:g} m must lie before end {self.end:g} m")
        return self


class Filter(_Settings):
    """Low-pass of the contact force; what each attribute means stands in `master.evaluation.filters.ForceFilter`."""

    kind: Literal["butterworth", "fft"] = "butterworth"
    order: int | None = Field(6, ge=1, le=20)
    cutoff: float = Field(20.0, gt=0)
    phase: Literal["zero", "causal"] | None = "zero"

    @model_validator(mode="before")
    @classmethod
    def _wall_is_plain(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("kind") == "fft":
            idle = [name for name in ("order", "phase") if data.get(name) is not None]
            if idle:
                raise ValueError(f"the filter fft has no {' and no '.join(idle)}; leave it out, or choose butterworth")
            return {**data, "order": None, "phase": None}
        return data


class Limits(_Settings):
    """Limits by which the figures are judged: those of EN 50367 for a supply system, and the scenario's own, in SI.

    Attributes
    ----------
    supply : str
        AC, DC3 (3 kV) or DC1.5 (1.5 kV).
    mean_upper, mean_lower, maximum, statistical_minimum : float, optional
        Of the contact force [N]; these and the next ones take the place of the standard's.
    sigma_share : float, optional
        Standard deviation over mean.
    nq : float, optional
        Percentage of arcing, as estimated [%].
    uplift, height_range : float, optional
        Of the supports, and of the contact point [m].
    """

    supply: Literal["AC", "DC3", "DC1.5"] = "AC"
    mean_upper: float | None = Field(None, alias="meanUpper", gt=0)
    mean_lower: float | None = Field(None, alias="meanLower", ge=0)
    maximum: float | None = Field(None, gt=0)
    sigma_share: float | None = Field(None, alias="sigmaShare", gt=0, le=1)
    statistical_minimum: float | None = Field(None, alias="statisticalMinimum")
    nq: float | None = Field(None, ge=0, le=100)
    uplift: float | None = Field(None, gt=0, lt=1)
    height_range: float | None = Field(None, alias="heightRange", gt=0, lt=1)

    @model_validator(mode="after")
    def _ordered(self) -> Limits:
        if None not in (self.mean_lower, self.mean_upper) and (self.mean_lower or 0.0) >= (self.mean_upper or 0.0):
            raise ValueError(f"meanLower {self.mean_lower:g} N must lie below meanUpper {self.mean_upper:g} N")
        return self


class Calibration(_Settings):
    """The parameter that is adjusted, and the mean contact force [N] that it has to give."""

    parameter: str
    mean_force: float = Field(alias="meanForce", gt=0)
    tolerance: float = Field(0.1, gt=0)
    contact: int = Field(1, ge=1)


class Record(_Settings):
    """Variables (``component.variable``, ``*`` for anything) recorded every so many seconds.

    ``every = 0`` means at every step. Later entries win where several match.
    """

    variables: tuple[str, ...]
    every: float = Field(0.0, ge=0)


#: Bulky variables of a catenary, recorded at a coarser rate unless the scenario says otherwise.
DEFAULT_RECORDS: Final = (
    Record(variables=("*.dropper[*].force", "*.dropper[*].slack", "*.support[*].uplift"), every=0.005),
)


class RunSettings(_Settings):
    """Everything that our annotation can say."""

    coupling: Coupling = Field(default_factory=lambda: Coupling.model_validate({}))
    interval: EvaluationInterval = Field(default_factory=EvaluationInterval)
    filter: Filter = Field(default_factory=lambda: Filter.model_validate({}))
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))
    calibration: Calibration | None = None
    records: tuple[Record, ...] = DEFAULT_RECORDS


_SECTIONS: Final[dict[str, type[_Settings]]] = {
    "Coupling": Coupling,
    "Interval": EvaluationInterval,
    "Filter": Filter,
    "Limits": Limits,
    "Calibration": Calibration,
    "Record": Record,
}
_LISTS: Final = ("order", "variables")
_TEXTS: Final = (*_LISTS, "scheme", "parameter", "kind", "phase", "supply", "until")
#: What an ``osp:Algorithm`` may hold.
_ALGORITHMS: Final = ("FixedStepAlgorithm", "VariableStepAlgorithm")


@dataclass(frozen=True)
class Annotations:
    """What the annotations of a scenario say; None where they are silent."""

    settings: RunSettings
    step: float | None


def parse_annotations(nodes: list[Any], reader: Reader) -> Annotations:
    """Read the run settings and the macro step from lists of ``ssd:Annotations``."""
    entries = [a for n in nodes for a in children(n, SSC, "Annotation")]
    ours = [a for a in entries if a.get("type") == NAMESPACE]
    steps = [s for a in entries if a.get("type") == OSP_TYPE if (s := parse_osp(a, reader)) is not None]
    if len(set(steps)) > 1:
        listed = " and ".join(f"{s:g} s" for s in steps)
        reader.problem(entries[0], "step", f"macro steps of {listed} are asked for; one is needed")
    for extra in ours[1:]:
        reader.problem(extra, "annotation", f"a second annotation of type {NAMESPACE}; one is enough")
    settings = parse_run(ours[0], reader) if ours else RunSettings()
    return Annotations(settings, steps[0] if steps else None)


def parse_osp(node: Any, reader: Reader) -> float | None:
    """Return the macro step [s] from ``osp:Algorithm/osp:FixedStepAlgorithm``."""
    steps = [_fixed_step(e, reader) for e in node.iter(etree.Element) if tag(e) in _ALGORITHMS]
    if len(steps) > 1:
        reader.problem(node, "step", f"{len(steps)} algorithms are asked for; one is needed")
    return steps[0] if steps else None


def _fixed_step(element: Any, reader: Reader) -> float | None:
    if tag(element) != "FixedStepAlgorithm":
        reader.problem(element, "unsupported", f"{tag(element)} is not supported; use FixedStepAlgorithm")
        return None
    step = reader.number(element, "baseStepSize")
    if step <= 0:
        reader.problem(element, "step", f"baseStepSize='{step:g}' must be greater than 0")
        return None
    return step if step == step else None


def parse_run(annotation: Any, reader: Reader) -> RunSettings:
    """Parse ``panto:Run``; every mistake becomes a problem and leaves that section at its default."""
    found: dict[str, list[_Settings]] = {name: [] for name in _SECTIONS}
    for run in elements(annotation):
        _check_plain(run, reader, "Run")
        for section in elements(run):
            parsed = parse_section(section, reader)
            if parsed is not None:
                found[tag(section)].append(parsed)
    once = [name for name in _SECTIONS if name != "Record"]
    for name in once:
        if len(found[name]) > 1:
            reader.problem(annotation, "annotation", f"{name} is given {len(found[name])} times; once is enough")
    single = {name.lower(): found[name][0] for name in once if found[name]}
    return RunSettings.model_validate({**single, "records": (*DEFAULT_RECORDS, *found["Record"])})


def _check_plain(node: Any, reader: Reader, name: str) -> None:
    """Report an element that is not the one expected, or has attributes, of which it has none."""
    if (tag(node), namespace(node)) != (name, NAMESPACE):
        reader.problem(node, "annotation", f"unknown element '{tag(node)}' (expected: {name} of {NAMESPACE})")
    for attribute in node.attrib:
        reader.problem(node, "annotation", f"{name} has no attribute '{attribute}'")


def check_places(root: Any, read: list[Any], reader: Reader) -> None:
    """Report our annotations in places where they are not read, and our elements in annotations of others."""
    for node in root.iter(f"{{{SSC}}}Annotation"):
        if node.get("type") == NAMESPACE and node.getparent() not in read:
            text = "is not read here; put it into the ssd:Annotations of the description or its DefaultExperiment"
            reader.problem(node, "annotation", f"an annotation of type {NAMESPACE} {text}")
    _tell_of_others(root, reader)
    for node in root.iter(f"{{{NAMESPACE}}}*"):
        if _is_stray(node):
            holder = next(node.iterancestors(f"{{{SSC}}}Annotation"), None)
            written = "no annotation" if holder is None else f"an annotation of type '{holder.get('type', '')}'"
            text = f"{tag(node)} of {NAMESPACE} stands in {written}, so nobody reads it; the type is {NAMESPACE}"
            reader.problem(node, "annotation", text)


def _tell_of_others(root: Any, reader: Reader) -> None:
    """Note which tools' annotations are not read; they may hold steps, solvers or events of those tools."""
    found = [a for a in root.iter(f"{{{SSC}}}Annotation") if a.get("type") not in (NAMESPACE, OSP_TYPE)]
    if found:
        names = several(list(dict.fromkeys(str(a.get("type")) for a in found)))
        text = f"annotations of type {names} are not read; what they say of steps, solvers and events has no effect"
        reader.warn(int(found[0].sourceline or 0), NOTE, text)


def _is_stray(node: Any) -> bool:
    """Whether an outermost element of ours is in no annotation of ours."""
    ancestors = list(node.iterancestors(etree.Element))
    within = any(namespace(a) == NAMESPACE for a in ancestors)
    return not within and not any(a.tag == f"{{{SSC}}}Annotation" and a.get("type") == NAMESPACE for a in ancestors)


def parse_section(node: Any, reader: Reader) -> _Settings | None:
    """Parse one element of ``panto:Run`` by its own model."""
    model = _SECTIONS.get(tag(node)) if namespace(node) == NAMESPACE else None
    if model is None:
        near = hint(tag(node), _SECTIONS)
        reader.problem(node, "annotation", f"unknown element '{tag(node)}' (known: {', '.join(_SECTIONS)}){near}")
        return None
    if next(elements(node), None) is not None:
        reader.problem(node, "annotation", f"{tag(node)} has an element inside, which nothing reads; remove it")
    for name, raw in node.attrib.items():
        if "_" in raw and name not in _TEXTS:  # Python, and so pydantic, reads 1_000 as a number
            reader.problem(node, "number", f"{tag(node)} {name}='{raw}' is not a number")
    values: dict[str, Any] = {k: v.split() if k in _LISTS else v for k, v in node.attrib.items()}
    try:
        return model.model_validate(values)
    except ValidationError as error:
        for item in error.errors():
            where = ".".join(str(part) for part in item["loc"][:1])
            named = f"{tag(node)} {where}".rstrip()
            if item["type"] == "extra_forbidden":
                known = [field.alias or name for name, field in model.model_fields.items()]
                text = f"{tag(node)} has no attribute '{where}' (known: {', '.join(known)}){hint(where, known)}"
            else:
                text = f"{named}: {item['msg'].removeprefix('Value error, ')}"
            reader.problem(node, "annotation", text)
        return None
