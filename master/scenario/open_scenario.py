"""From a scenario's files to a runnable system; the place where overrides of the command line enter."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from master.errors import Problem, RequestError, ScenarioError
from master.fmu import fmu_provision
from master.fmu.fmu_description import lacking_binary, read_fmu
from master.scenario import switched_inputs, value_checks
from master.scenario.overrides import Overrides, effective_settings, with_energy, with_values
from master.scenario.scenario_checks import ScenarioChecks
from master.scenario.scenario_place import fmu_cache, located
from master.ssp.archive import SSD_NAME, Package, Sources, open_package
from master.ssp.run_settings import RunSettings
from master.ssp.ssd import EMPTY, Structure, read_structure
from master.ssp.ssd_elements import Component as SsdComponent
from master.ssp.ssm import NOTE
from master.ssp.ssp_xml import Reader
from master.system.components import Fmu, System, without

DEFAULT_STEP = 1e-3
#: Most macro steps of a run: ten thousand seconds in steps of 1 ms, whose recording still fits into memory.
MAX_STEPS = 10**7
#: Smallest step relative to the times it leads to: rounding then leaves nine digits of it.
_RESOLUTION = 1e-7


@dataclass(frozen=True)
class Scenario:
    """An opened scenario: its files and the system they describe."""

    package: Package
    system: System


@contextmanager
def open_scenario(
    path: Path,
    overrides: Overrides | None = None,
    tell: Callable[[str], None] = lambda _: None,
    build: bool = True,
    is_check: bool = False,
) -> Iterator[Scenario]:
    """Open, build what is missing, check and resolve a scenario.

    Parameters
    ----------
    path : Path
        Folder or ``.ssp`` archive, project folder, or name in the library (`scenario_place.located`).
    overrides : Overrides, optional
        Changes from the command line.
    tell : callable
        Called with what takes time (building FMUs).
    build : bool
        Whether missing or stale FMUs are built.
    is_check : bool
        Whether nothing may be written: FMUs are built into a temporary folder, for inspection only.

    Raises
    ------
    ScenarioError
        With every problem found.
    """
    with open_package(located(path)) as package, _scratch(package, is_check) as scratch:
        yield Scenario(package, load_system(package, overrides or Overrides(), tell, build, scratch))


@contextmanager
def _scratch(package: Package, is_check: bool) -> Iterator[Callable[[], Path] | None]:
    """Yield what gives the folder that FMUs are built into, made when one is; None for their place in the scenario."""
    place = None if is_check else fmu_cache(package.root)
    with ExitStack() as stack:
        if is_check:
            yield cache(lambda: Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="openpanto_"))))
        else:
            yield None if place is None else lambda: place


def load_system(
    package: Package,
    overrides: Overrides,
    tell: Callable[[str], None],
    build: bool,
    scratch: Callable[[], Path] | None = None,
) -> System:
    """Read and check the files of ``package``; FMUs are built into what ``scratch`` gives if there is one."""
    reader = Reader(SSD_NAME)
    sources = Sources(package.root, overrides.outside, None if package.writable else package.origin)
    structure = read_structure(sources, reader)
    if structure is EMPTY:  # without it everything would be missing
        raise ScenarioError(reader.problems)
    provision = _Provision(build and package.writable, tell, scratch, package.root)
    fmus = _fmus(sources, structure.components, reader.problems, provision, overrides)
    checker = ScenarioChecks(structure, fmus, reader.problems, reader.warnings)
    connections = checker.connections()
    components = checker.components(connections)
    times = _times(structure, overrides, reader.problems)
    settings = effective_settings(structure, overrides, components, reader.problems)
    reader.problems.extend(_filter_problems(settings, times[2]))
    problems = reader.problems or ([w for w in reader.warnings if w.rule != NOTE] if overrides.strict else [])
    if problems:
        raise ScenarioError(_sorted(problems))
    components = with_values(components, overrides.parameters)
    if overrides.tolerance is not None:
        components = tuple(replace(c, tolerance=overrides.tolerance) for c in components)
    if overrides.energy:
        components, settings = with_energy(components, settings)
    warnings = tuple(str(w) for w in _sorted(reader.warnings))
    may_stop, title = overrides.may_stop_early, structure.title
    system = System(
        package.name, components, connections, *times, settings, warnings, may_stop, title, overrides.parameters
    )
    text = value_checks.empty_cells(system, overrides.empty)
    if text := text or value_checks.half_empty_rows(system, overrides.empty, overrides.absent):
        raise RequestError(text)
    system = without(system, overrides.absent)
    system = replace(system, warnings=(*system.warnings, *switched_inputs.doubts(system)))
    if overrides.stop is None and _ends_with_interval(structure):
        system = _until_end(system)
    found = list(value_checks.problems(system, system.may_stop_early))
    if found:
        raise ScenarioError([Problem(SSD_NAME, 0, "interval", text) for text in found])
    return system


def _ends_with_interval(structure: Structure) -> bool:
    """Whether the run ends with the interval of interest rather than at a stop time."""
    interval = structure.annotations.settings.interval
    if interval.until is None:
        return structure.stop is None and interval.end is not None
    return interval.until == "end"


def _until_end(system: System) -> System:
    stop = value_checks.stop_after_interval(system)
    text = stop if isinstance(stop, str) else _step_problem(system.start, stop, system.step)
    if text or isinstance(stop, str):
        raise ScenarioError([Problem(SSD_NAME, 0, "stop", text)])
    return replace(system, stop=stop)


def _sorted(problems: Iterable[Problem]) -> list[Problem]:
    return sorted(dict.fromkeys(problems), key=lambda p: (p.file, p.line))


def _fmus(
    sources: Sources,
    components: Iterable[SsdComponent],
    problems: list[Problem],
    provision: _Provision,
    overrides: Overrides,
) -> dict[str, Fmu]:
    found: dict[str, Fmu] = {}
    by_path: dict[Path, Fmu | str] = {}
    for c in components:
        if not c.source:
            if not any(p.line == c.line and "'source'" in p.text for p in problems):
                problems.append(Problem(SSD_NAME, c.line, "source", f"component '{c.name}' has an empty source"))
            continue
        source = overrides.source(c.source)
        path = sources.find(source)
        if path is None:
            text = f"'{c.source}' does not lie inside the scenario; --allow-outside DIR allows a folder beside it"
            problems.append(Problem(SSD_NAME, c.line, "source", text))
            continue
        if path not in by_path:
            may_build = provision.build and sources.is_inside(path)
            by_path[path] = _provide(path, replace(provision, build=may_build))
        fmu = by_path[path]
        if isinstance(fmu, str):
            problems += _unprovided(c.name, source, c.line, fmu)
        else:
            found[c.name] = fmu
    return found


def _unprovided(name: str, source: str, line: int, why: str) -> list[Problem]:
    """Return why a component has no FMU; each mistake in a definition is told with its place there first."""
    first, *others = why.split("\n")
    lines = [re.sub("^(could not|cannot) be built: ", "", first), *others]
    found = [re.fullmatch(r"(?P<file>.*?\.toml): (?P<text>.+)", text) for text in lines]
    if lines[0] == first or found[0] is None:
        return [Problem(SSD_NAME, line, "fmu", f"component '{name}': {source} {why.replace(chr(10), '; ')}")]
    problems, file = [], found[0]["file"]
    for text, mistake in zip(lines, found, strict=True):
        at = re.search(r"\(at line (\d+),", text)
        file, text = (file, text) if mistake is None else (mistake["file"], mistake["text"])
        problems.append(Problem(file, int(at[1]) if at else 0, "definition", text))
    last = f"{problems[-1].text}; so {source} of component '{name}' ({SSD_NAME}:{line}) cannot be built"
    return [*problems[:-1], replace(problems[-1], text=last)]


@dataclass(frozen=True)
class _Provision:
    """How FMUs are provided.

    Whether they may be built, who is informed, where to if not in their place, where definitions are looked up first.
    """

    build: bool
    tell: Callable[[str], None]
    scratch: Callable[[], Path] | None
    library: Path


def _provide(path: Path, provision: _Provision) -> Fmu | str:
    try:
        place = path
        if provision.build:
            place = fmu_provision.provide_fmu(path, provision.tell, provision.scratch, provision.library)
        if not place.is_file():
            return "is a folder, not an FMU" if place.is_dir() else f"does not exist{_without(place, provision)}"
        fmu = read_fmu(place)
        return lacking_binary(place, fmu.identifier) or fmu
    except ValueError as error:
        return str(error)


def _without(path: Path, provision: _Provision) -> str:
    """Return which definition an FMU that is not there would be built from, empty if its name says none."""
    found = re.fullmatch(r"(?P<kind>Catenary|Pantograph)_(?P<name>\w+?)(_P\d+)?", path.stem)
    if not provision.build or found is None or not fmu_provision.has_builder():
        return ""
    place = f"{'lines' if found['kind'] == 'Catenary' else 'pantographs'}/{found['name']}.toml"
    return f", nor does a definition to build it from, {place} in the project: give it that name, or bring the FMU"


def _times(structure: Structure, overrides: Overrides, problems: list[Problem]) -> tuple[float, float, float]:
    start = structure.start
    stop = overrides.stop if overrides.stop is not None else structure.stop
    step = overrides.step if overrides.step is not None else structure.annotations.step or DEFAULT_STEP
    if stop is None and _ends_with_interval(structure):
        return start, start + step, step  # until the system is known
    if stop is None:
        text = "no stopTime in ssd:DefaultExperiment, nor an end in Interval; give --stop"
        problems.append(Problem(SSD_NAME, 0, "stop", text))
        stop = start + step
    if math.isnan(start) or math.isnan(stop):
        return 0.0, step, step  # reported where it is written
    if not (math.isfinite(start) and start < stop < math.inf):
        problems.append(Problem(SSD_NAME, 0, "stop", f"stop time {stop:g} s must lie after start time {start:g} s"))
    elif text := _step_problem(start, stop, step):
        problems.append(Problem(SSD_NAME, 0, "step", f"macro step {step:g} s {text}"))
    return start, stop, step


def _step_problem(start: float, stop: float, step: float) -> str:
    """Return why a run cannot use this step, empty if it can."""
    if not 0 < step <= stop - start:
        return f"must lie between 0 and {stop - start:g} s"
    if (stop - start) / step > MAX_STEPS:
        return f"makes {(stop - start) / step:.3g} steps, more than {MAX_STEPS:g}; take longer ones or stop earlier"
    if step < _RESOLUTION * max(abs(start), abs(stop)):
        return f"is lost in rounding at times up to {max(abs(start), abs(stop)):g} s; start nearer to 0"
    return ""


def _filter_problems(settings: RunSettings, step: float) -> Iterator[Problem]:
    """Yield a problem if the wanted cutoff lies above all frequencies that are sampled."""
    cutoff = settings.filter.cutoff
    if "filter" in settings.model_fields_set and 2.0 * cutoff * step >= 1.0:
        half = f"half the sampling frequency, {0.5 / step:g} Hz at a macro step of {step:g} s"
        text = f"Filter cutoff {cutoff:g} Hz is not below {half}: it would filter nothing; lower it or the step"
        yield Problem(SSD_NAME, 0, "annotation", text)
