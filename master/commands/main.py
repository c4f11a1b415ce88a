"""The command line: ``python -m master [VERB] ...``.

Exit codes: 0 done; 1 failed, invalid or incomplete (scenario, definition, FMU, results, limits that must hold in
``verify``); 2 only a command line that was not understood; docs/reliability.md says more.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from master.batch import calibration
from master.commands import report_commands, study_command, verify_command
from master.coupling.fmu_warnings import CautionObserver
from master.errors import MasterError, Problem, RequestError, RunError, ScenarioError, UsageError
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_signals import EvaluationSettings
from master.fmu.fmu_provision import write_runtime
from master.fmu.isolation import INIT_TIMEOUT, Isolation
from master.recording import checkpoint
from master.recording.checkpoint import Continuation
from master.report import report_files, result_tables
from master.report.charts.output_charts import has_contacts, outputs_table
from master.report.progress import ProgressObserver
from master.report.terminal_summary import Terminal, printable_json
from master.results import parquet_export, run_results
from master.results.run_results import Results
from master.run import Manner, run
from master.scenario import scenario_advice as limits
from master.scenario.open_scenario import Overrides, find_parameter, open_scenario
from master.ssp.archive import SSD_NAME, Package, Sources
from master.ssp.pack import left_out, pack
from master.ssp.run_settings import SCHEMES, Calibration
from master.ssp.ssd import read_structure
from master.ssp.ssp_xml import Reader
from master.system.components import System
from master.system.step_rounding import adjustments

#: Where an archive holds one Python for all its FMUs.
RUNTIME: Final = "resources/runtime"
VERBS: Final = ("run", "pack", "validate", "compare", "report", "calibrate", "verify", "study")
_WIDTH: Final = 80
_PLAIN: Final = Manner()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] not in VERBS and given[0] not in ("-h", "--help"):
        given.insert(0, "run")
    options = _parser().parse_args(given)
    error = Terminal(stderr=True, width=_WIDTH if not sys.stderr.isatty() else None, soft_wrap=True)
    try:
        code: int = options.verb(options)
        sys.stdout.flush()  # here, where an error can still be told
    except UsageError as failure:
        return _fail(error, failure, 2)
    except MasterError as failure:
        return _fail(error, failure, 1)
    except BrokenPipeError:
        return 1
    except KeyboardInterrupt:
        return _fail(error, "interrupted", 1)
    except OSError as failure:
        return _fail(error, f"{failure.filename or 'standard output'}: {failure.strerror or failure}", 1)
    return code


def _fail(console: Console, failure: object, code: int) -> int:
    console.print(f"error: {failure}", style="red", markup=False, highlight=False, emoji=False)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m master",
        description="Run pantograph-catenary scenarios (SSP) and judge the contact quality.",
        epilog="'run' may be left out: python -m master SCENARIO ...",
    )
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    _add_run(verbs)
    checking = _add(verbs, "validate", "check a scenario without running it", _validate, scenario=True)
    _add_overrides(checking)
    _add_tolerance(checking)
    packing = _add(verbs, "pack", "write a scenario as a .ssp archive, FMUs included", _pack, scenario=True)
    packing.add_argument("--out", type=Path, metavar="FILE", help="default: dist/NAME.ssp")
    packing.add_argument(
        "--standalone",
        action="store_true",
        help=f"with the Python that the FMUs run in, as {RUNTIME}, for tools where OPENPANTO_RUNTIME names it",
    )
    report_commands.add_compare_arguments(
        _add(verbs, "compare", report_commands.COMPARE_HELP, report_commands.run_compare)
    )
    report_commands.add_report_arguments(_add(verbs, "report", report_commands.REPORT_HELP, report_commands.run_report))
    _add_calibrate(verbs)
    verify_command.add_arguments(_add(verbs, "verify", verify_command.HELP, verify_command.run))
    study_command.add_arguments(_add(verbs, "study", study_command.HELP, study_command.run))
    return parser


def _add(verbs: Any, name: str, text: str, verb: Callable[..., int], scenario: bool = False) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text)
    parser.set_defaults(verb=verb)
    if scenario:
        parser.add_argument("scenario", type=Path, metavar="SCENARIO", help="folder NAME.ssp/ or archive NAME.ssp")
        parser.add_argument("--no-build", action="store_true", help="do not build missing or stale FMUs")
    return parser


def _add_run(verbs: Any) -> None:
    parser = _add(verbs, "run", "run a scenario", _run, scenario=True)
    _add_overrides(parser)
    _add_tolerance(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="results folder, default: results/NAME")
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no tables")
    parser.add_argument("--no-report", action="store_true", help="no plots, no report.html")
    parser.add_argument("--json", action="store_true", help="print summary.json instead of tables")
    parser.add_argument("--checkpoint", type=_number, metavar="T", help="write the whole state at time T to DIR")
    parser.add_argument(
        "--checkpoint-every", type=_positive, metavar="T", help="write it after every T seconds of simulated time"
    )
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="DIR|FILE",
        help="finish the run in results folder DIR from its last checkpoint; or begin a new run from checkpoint FILE",
    )
    parser.add_argument(
        "--renew", action="append", default=[], metavar="COMPONENT", help="with --resume: this component starts anew"
    )
    parser.add_argument("--energy", action="store_true", help="watch the energy balance, report its drift")
    parser.add_argument("--parquet", action="store_true", help="write the time series as Parquet too")
    parser.add_argument("--isolate", action="store_true", help="each FMU in a process of its own: it may crash")
    parser.add_argument(
        "--step-timeout", type=_positive, metavar="S", help="with --isolate: a step of more than S seconds has failed"
    )
    parser.add_argument(
        "--init-timeout",
        type=_positive,
        metavar="S",
        help=f"with --isolate: loading or initialising for more than S seconds has failed, default {INIT_TIMEOUT:g}",
    )
    parser.add_argument(
        "--real-time",
        type=_positive,
        nargs="?",
        const=1.0,
        metavar="FACTOR",
        help="keep to the wall clock, FACTOR simulated seconds a second (default 1)",
    )


def _add_tolerance(parser: argparse.ArgumentParser) -> None:
    text = "relative tolerance for all FMUs, default: that of their default experiments"
    parser.add_argument("--tolerance", dest="fmu_tolerance", type=_positive, metavar="R", help=text)


def _add_overrides(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--strict", action="store_true", help="warnings of the scenario are errors")
    parser.add_argument(
        "--allow-outside",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="the scenario may name files in this folder outside of it, such as FMUs that scenarios share",
    )
    parser.add_argument("--stop", type=_number, metavar="T", help="stop time [s]")
    parser.add_argument("--step", type=_positive, metavar="H", help="macro step [s]")
    parser.add_argument("--scheme", choices=SCHEMES, help="coupling scheme")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=_assignment,
        metavar="COMPONENT.PARAMETER=VALUE",
        help="change a parameter",
    )


def _add_calibrate(verbs: Any) -> None:
    text = "find the parameter value that gives the wanted mean force and store it in the scenario"
    parser = _add(verbs, "calibrate", text, _calibrate, scenario=True)
    _add_overrides(parser)
    parser.add_argument(
        "--parameter", metavar="COMPONENT.PARAMETER", help="what to change; default: as the scenario says"
    )
    parser.add_argument(
        "--mean", type=_positive, metavar="N", help="wanted mean force [N]; default: as the scenario says"
    )
    parser.add_argument("--tolerance", type=_positive, metavar="N", help="how near is near enough [N], default 0.1")
    parser.add_argument("--dry-run", action="store_true", help="do not store the value")


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text or not text.isascii():
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
    return value


def _positive(text: str) -> float:
    value = _number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"'{text}' must be greater than 0")
    return value


def _assignment(text: str) -> tuple[str, str]:
    name, sign, value = text.partition("=")
    if not (name and sign and value):
        raise argparse.ArgumentTypeError(f"'{text}' must be written COMPONENT.PARAMETER=VALUE")
    return name, value


def _overrides(options: argparse.Namespace) -> Overrides:
    outside = tuple(options.allow_outside)
    for folder in outside:
        if not folder.is_dir():
            raise MasterError(f"--allow-outside {folder}: there is no such folder")
    return Overrides(
        options.stop,
        options.step,
        options.scheme,
        dict(options.set),
        tolerance=getattr(options, "fmu_tolerance", None),
        strict=options.strict,
        outside=outside,
    )


def _run_overrides(options: argparse.Namespace) -> Overrides:
    """Return the changes of a run: one that is told when to stop may stop before it can be judged."""
    return replace(_overrides(options), energy=options.energy, may_stop_early=options.stop is not None)


def _tell(text: str, console: Console | None = None) -> None:
    (console or Terminal(stderr=True)).print(text, style="dim", markup=False, highlight=False, emoji=False)


def _run(options: argparse.Namespace) -> int:
    tell = (lambda _: None) if options.quiet else _tell
    manner = _manner(options)
    with open_scenario(options.scenario, _run_overrides(options), tell, not options.no_build) as scenario:
        folder = _folder(options, scenario.system)
        _protect(folder, scenario.package)
        _tell_warnings(scenario.system, tell)
        with run_results.claimed(folder):  # until the report is written too
            try:
                done = _run_shown(scenario.system, folder, options.quiet, manner)
            except RunError:
                if not options.no_report:
                    _report_what_there_is(folder)
                raise
            _tell_results(done, options)
    return 0


def _tell_results(done: Results, options: argparse.Namespace) -> None:
    if not options.no_report:
        report_files.write(done)
    if options.parquet:
        parquet_export.write_parquet(done.folder)
    if options.json:
        print(printable_json((done.folder / run_results.SUMMARY).read_text(encoding="utf-8")), end="")
    elif not options.quiet:
        _show(done)


def _report_what_there_is(folder: Path) -> None:
    # Why the run stopped is what the user has to know, not that there is no room for its report either.
    with suppress(OSError):
        report_commands.report_what_there_is(folder)


def _folder(options: argparse.Namespace, system: System) -> Path:
    """Return where the results go: a run that is finished stays in its folder."""
    out: Path = options.out or Path("results") / system.name
    if options.resume is None or not options.resume.is_dir():
        return out
    resumed: Path = options.resume
    if options.out is not None and out.resolve() != resumed.resolve():
        raise UsageError(
            f"--resume {resumed} finishes the run in that folder: leave --out away, or give the file "
            f"{resumed / checkpoint.NAME} to begin a new run from it"
        )
    return resumed


def _protect(folder: Path, package: Package) -> None:
    if folder.resolve().is_relative_to(package.root) or package.root.is_relative_to(folder.resolve()):
        raise RequestError(
            f"the results folder {folder} and the scenario lie inside each other; choose another with --out"
        )


def _manner(options: argparse.Namespace) -> Manner:
    if options.step_timeout is not None and not options.isolate:
        raise UsageError(
            "--step-timeout needs --isolate: only a process of its own can be ended when it does not return"
        )
    if options.init_timeout is not None and not options.isolate:
        raise UsageError(
            "--init-timeout needs --isolate: only a process of its own can be ended when it does not return"
        )
    limits = (options.step_timeout, options.real_time is not None, options.init_timeout or INIT_TIMEOUT)
    isolation = Isolation(*limits) if options.isolate else None
    every = options.checkpoint_every
    return Manner(options.checkpoint, every, _continuation(options), isolation, options.real_time)


def _continuation(options: argparse.Namespace) -> Continuation | None:
    if options.resume is None:
        if options.renew:
            raise UsageError("--renew says what a run does not take from its checkpoint; it needs --resume FILE")
        return None
    is_same_run = options.resume.is_dir()
    file = options.resume / checkpoint.NAME if is_same_run else options.resume
    if is_same_run and not file.is_file():
        raise RequestError(
            f"{options.resume} holds no {checkpoint.NAME} to go on from: the run was started without "
            "--checkpoint-every, or ended before the first one; run it again"
        )
    return Continuation(checkpoint.read(file), str(file), tuple(options.renew), is_same_run)


def _run_shown(system: System, folder: Path, quiet: bool, manner: Manner = _PLAIN) -> Results:
    if quiet:
        return run(system, folder, (), manner)
    console = Terminal(stderr=True)  # that of the progress bar, which then stays below
    for text in adjustments(system, manner.checkpoint_every):
        _tell(f"warning: {text}", console)
    cautions = CautionObserver(lambda caution: _tell(str(caution), console))
    if manner.real_time is not None:  # drawing takes more time than a step has
        _tell(f"running for {(system.stop - system.start) / manner.real_time:g} s by the wall clock")
        return run(system, folder, [cautions], manner)
    progress = ProgressObserver(console, system.start, system.stop)
    try:
        return run(system, folder, [cautions, progress], manner)
    finally:
        progress.finish()


def _show(done: Results) -> None:
    console = Terminal(width=_WIDTH, highlight=False)
    assessments = done.assessments()
    if assessments:
        heads = [a.contact.pantograph for a in assessments]
        console.print(result_tables.figures_table(assessments, heads, [done.evaluation.filter]))
    for assessment in assessments:
        _show_verdict(console, assessment, done.evaluation)
    if not has_contacts(done):
        console.print(outputs_table(done))
    elif done.not_judged:
        console.print(f"not judged: {done.not_judged}", style="yellow", markup=False, soft_wrap=True)
    elif not assessments:
        console.print("no contact-quality figures: the run has no contact force in the interval of interest")
    for line in filter(None, (result_tables.calibration_line(done), result_tables.uplift_line(done))):
        console.print(line, markup=False, soft_wrap=True)
    for following in done.followings:
        console.print(following.sentence, markup=False, soft_wrap=True)
    for line in _closing_lines(done):
        console.print(line, markup=False, soft_wrap=True)


def _show_verdict(console: Console, assessment: Assessment, settings: EvaluationSettings) -> None:
    """Print the verdict of a contact, and what makes it less than certain."""
    if assessment.withheld:
        text = f"{assessment.contact.pantograph}: not judged: {assessment.withheld}"
        console.print(text, style="yellow", markup=False, soft_wrap=True)
    else:
        console.print(result_tables.verdict_table(assessment, settings.limits))
    if rows := result_tables.filter_rows(assessment.quality, settings.filter):
        console.print(f"the extremes of {assessment.contact.pantograph} depend on the filter:", markup=False)
        console.print(result_tables.plain_table(result_tables.FILTER_HEADS, rows))
    for warning in assessment.warnings:
        console.print(f"warning: {assessment.contact.pantograph}: {warning}", markup=False)


def _closing_lines(done: Results) -> list[str]:
    performance = done.summary["performance"]
    lines = [
        f"wall time {performance['wall_time']:.2f} s, "
        f"initialization {performance['initialisation_time']:.2f} s, "
        f"real-time factor {performance['real_time_factor']:.2f}, {performance['peak_memory']:.0f} MB",
    ]
    lines += [
        f"contact {p['contact']}: coupling added {p['energy']:.3g} J of {p['transferred']:.4g} J exchanged"
        for p in done.summary["interface_power"]
    ]
    lines += _energy_lines(done.summary["energy"])
    if tolerance := _told_tolerance({c["name"]: c.get("tolerance") for c in done.summary.get("components", [])}):
        lines.append(tolerance.removeprefix(", "))
    return [*lines, *_punctuality_lines(performance.get("real_time")), f"results in {done.folder}"]


def _energy_lines(found: Sequence[dict[str, Any]]) -> list[str]:
    """Return the drifts of the energy balances in one line, and a warning for each that is too large."""
    drifts = ", ".join(f"{b['what']} {b['share']:.1g} of {b['passed']:.4g} J" for b in found)
    beyond = [b for b in found if b["exceeded"] is not None]
    warnings = [f"warning: the energy of {b['what']} does not balance: {b['text']}" for b in beyond]
    return [f"energy drift: {drifts}", *warnings] if found else []


def _punctuality_lines(found: dict[str, Any] | None) -> list[str]:
    """Return how a run kept up with the wall clock, in words."""
    if found is None:
        return []
    jitter, late = found["start_jitter"], found["lateness"]
    return [
        f"real time x {found['factor']:g}: {found['missed']} of {found['steps']} deadlines missed "
        f"({100.0 * found['missed_share']:.3g} %), results late by up to {1e3 * late['maximum']:.3g} ms; "
        f"steps took {1e3 * found['mean_step']:.3g} ms, the longest {1e3 * found['longest_step']:.3g} ms",
        f"steps began late by {1e3 * jitter['mean']:.3g} ms on average, {1e3 * jitter['percentile_99']:.3g} ms at "
        f"99 %, {1e3 * jitter['maximum']:.3g} ms at most",
    ]


def _validate(options: argparse.Namespace) -> int:
    with open_scenario(
        options.scenario, _overrides(options), _tell, build=not options.no_build, is_check=True
    ) as scenario:
        system = scenario.system
        _tell_warnings(system, _tell)
        counts = f"{len(system.components)} components, {len(system.connections)} connections"
        times = f"{system.start:g} s to {system.stop:g} s in steps of {system.step:g} s"
        for text in (*limits.warnings(system), *adjustments(system)):
            _tell(f"warning: {text}")
        tolerance = _told_tolerance({c.name: c.tolerance for c in system.components})
        print(f"{system.name}: valid; {counts}, {times}, {system.settings.coupling.scheme}{tolerance}")
    return 0


def _tell_warnings(system: System, tell: Callable[[str], None]) -> None:
    for text in system.warnings:
        tell(f"warning: {text}")


def _told_tolerance(told: Mapping[str, float | None]) -> str:
    """Return in words which tolerance the FMUs are told, by their components' names; empty if none is."""
    values = set(told.values())
    if values <= {None}:
        return ""
    if len(values) == 1:
        return f", tolerance {values.pop():g} for all FMUs"
    return ", tolerance " + ", ".join(f"{value:g} for {name}" for name, value in told.items() if value is not None)


def _pack(options: argparse.Namespace) -> int:
    with open_scenario(options.scenario, tell=_tell, build=not options.no_build) as scenario:
        _tell_warnings(scenario.system, _tell)
        archive = options.out or Path("dist") / f"{scenario.system.name}.ssp"
        if archive.is_dir():
            raise RequestError(f"{archive} is a folder; choose another name with --out")
        root = scenario.package.root
        with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
            added = {RUNTIME: _runtime(Path(folder))} if options.standalone else {}
            print(pack(root, archive, added))
        if names := left_out(root):
            _tell(f"left out, for {SSD_NAME} does not name it: {', '.join(names)}")
    return 0


def _runtime(folder: Path) -> Path:
    """Write the Python that FMUs run in on a machine that has none; return its folder."""
    try:
        write_runtime(folder)
    except ValueError as error:
        raise MasterError(f"the archive cannot be standalone: {error}") from error
    return folder


def _calibrate(options: argparse.Namespace) -> int:
    is_stored = not (options.dry_run or options.set)
    is_folder = options.scenario.is_dir()
    with calibration.unchanged(options.scenario) if is_stored and is_folder else nullcontext(lambda: None) as check:
        return _calibrated(options, is_stored, check)


def _calibrated(options: argparse.Namespace, is_stored: bool, check: Callable[[], None]) -> int:
    with open_scenario(options.scenario, _overrides(options), _tell, not options.no_build) as scenario:
        system = scenario.system
        _tell_warnings(system, _tell)
        task = _task(options, system)
        place = _place(scenario.package, task.parameter) if is_stored else None
        found = _found(system, task)
        print(
            f"{task.parameter} = {found.value:.6g} gives a mean force of {found.result:.2f} N "
            f"({len(found.trials)} runs; filter {_filter_of(system)})"
        )
        if place is not None:
            note = (
                f"mean force {found.result:.2f} N (wanted {task.mean_force:g} N) after {_filter_of(system)}, with "
                f"{system.settings.coupling.scheme}, macro step {system.step:g} s, "
                f"in {len(found.trials)} runs of 'python -m master calibrate'"
            )
            check()
            calibration.store_value(*place, found.value, note)
            print(f"stored in {place[0]}")
    return 0


def _filter_of(system: System) -> str:
    return run_results.filter_of(system.settings.filter.model_dump()).short


def _found(system: System, task: Calibration) -> calibration.Found:
    start = _start_value(system, task.parameter)
    return calibration.find_value(lambda value: _trial(system, task, value), task.mean_force, start, task.tolerance)


def _task(options: argparse.Namespace, system: System) -> Calibration:
    known = system.settings.calibration
    parameter = options.parameter or (known.parameter if known else None)
    mean = options.mean or (known.mean_force if known else None)
    if parameter is None or mean is None:
        raise RequestError("the scenario says neither what to calibrate nor to what; give --parameter and --mean")
    tolerance = options.tolerance or (known.tolerance if known else 0.1)
    return Calibration(parameter=parameter, meanForce=mean, tolerance=tolerance, contact=known.contact if known else 1)


def _start_value(system: System, parameter: str) -> float:
    index, variable = find_parameter(system.components, parameter)
    component = system.components[index]
    if variable.type != "Real":
        raise RequestError(f"parameter '{parameter}' is not Real and cannot be calibrated")
    return float(component.parameters.get(variable.name, variable.start or 0.0))


def _trial(system: System, task: Calibration, value: float) -> float:
    index, variable = find_parameter(system.components, task.parameter)
    component = system.components[index]
    changed = replace(component, parameters={**component.parameters, variable.name: value})
    components = (*system.components[:index], changed, *system.components[index + 1 :])
    with tempfile.TemporaryDirectory(prefix="calibrate-") as folder:
        done = _run_shown(replace(system, components=components), Path(folder), quiet=False)
        for assessment in done.assessments():
            if assessment.quality.contact == task.contact:
                _tell(f"{task.parameter} = {value:.6g}: mean force {assessment.quality.mean:.3f} N")
                return assessment.quality.mean
    raise MasterError(f"contact {task.contact} has no figures in the interval of interest; nothing to calibrate on")


def _place(package: Package, parameter: str) -> tuple[Path, str]:
    """Return the ``.ssv`` file that holds a parameter, and its name there."""
    if not package.writable:
        raise RequestError(f"{package.origin} is an archive; calibrate its folder, or use --dry-run")
    structure = read_structure(Sources(package.root), Reader(SSD_NAME))
    for c in structure.components:
        for binding in c.bindings:
            for p in binding.parameters.parameters:
                if f"{c.name}.{binding.prefix}{p.name}" == parameter:
                    return package.root / p.file, p.name
    text = f"parameter '{parameter}' is not in the scenario's parameter files; add it, or use --dry-run"
    raise ScenarioError([Problem(SSD_NAME, 0, "calibration", text)])
