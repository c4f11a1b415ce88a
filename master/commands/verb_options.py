"""The verbs of the command line and their options: declared here, carried out by one file each, or two verbs by one.

Those files import what they need, NumPy and the FMI library for most; this one nothing that takes time, so that help,
completion and a mistyped option are answered at once. What can be chosen is written out, and tests compare it with the
kinds that there are.
"""

from __future__ import annotations

import argparse
import importlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from master.errors import hint
from master.ssp.ssp_units import number_advice

#: What can be chosen; tests/test_registries.py.
SCHEMES: Final = ("jacobi", "gauss-seidel", "iterative")
FORMATS: Final = ("png", "svg")
KEPT: Final = ("all", "thinned", "figures", "failed")
ENGINES: Final = ("fmu", "lanes")
SAMPLINGS: Final = ("lhs", "sobol")
SENSITIVITIES: Final = ("sobol", "morris")
FAULTS_OF: Final = ("each-dropper", "each-arm")


def add_run(verbs: Any) -> None:
    """Declare ``run`` and its options."""
    parser = add_verb(verbs, "run", "run a scenario", _later("run_command", "run_verb"), scenario=True)
    add_overrides(parser)
    add_tolerance(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="results folder, default: results/NAME")
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no tables")
    parser.add_argument("--no-report", action="store_true", help="no plots, no report.html")
    add_figures(parser)
    parser.add_argument("--json", action="store_true", help="print summary.json instead of tables")
    parser.add_argument("--checkpoint", type=finite_number, metavar="T", help="write the whole state at time T to DIR")
    parser.add_argument(
        "--checkpoint-every", type=positive_number, metavar="T", help="write it every T seconds of simulated time"
    )
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="DIR|FILE",
        help="finish the run in results folder DIR from its last checkpoint; or begin a new run from checkpoint FILE",
    )
    parser.add_argument(
        "--renew", action="append", default=[], metavar="COMPONENT", help="with --resume: this component starts afresh"
    )
    parser.add_argument("--energy", action="store_true", help="check the energy balance and report its drift")
    parser.add_argument("--parquet", action="store_true", help="also write the time series as Parquet")
    parser.add_argument("--isolate", action="store_true", help="run each FMU in a separate process, which may crash")
    parser.add_argument(
        "--step-timeout",
        type=positive_number,
        metavar="S",
        help="with --isolate: longest that a step may take",
    )
    parser.add_argument(
        "--init-timeout",
        type=positive_number,
        metavar="S",
        help="with --isolate: longest that loading or initialising may take, default 300",
    )
    parser.add_argument(
        "--real-time",
        type=positive_number,
        nargs="?",
        const=1.0,
        metavar="FACTOR",
        help="keep pace with the wall clock: FACTOR simulated seconds per second (default 1)",
    )


def add_validate(verbs: Any) -> None:
    """Declare ``validate`` and its options."""
    parser = add_verb(
        verbs,
        "validate",
        "check a scenario without running it",
        _later("scenario_commands", "validate_verb"),
        scenario=True,
    )
    add_overrides(parser)
    add_tolerance(parser)


def add_pack(verbs: Any) -> None:
    """Declare ``pack`` and its options."""
    parser = add_verb(
        verbs,
        "pack",
        "write a scenario as a .ssp archive, FMUs included",
        _later("scenario_commands", "pack_verb"),
        scenario=True,
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="default: dist/NAME.ssp")
    parser.add_argument(
        "--standalone",
        action="store_true",
        help="include the Python that FMUs run in, as resources/runtime, for tools where OPENPANTO_RUNTIME names it",
    )


def add_calibrate(verbs: Any) -> None:
    """Declare ``calibrate`` and its options."""
    text = "find the parameter value that gives the wanted mean force, and store it in the scenario"
    parser = add_verb(verbs, "calibrate", text, _later("calibrate_command", "calibrate_verb"), scenario=True)
    add_overrides(parser)
    parser.add_argument(
        "--parameter", metavar="COMPONENT.PARAMETER", help="what to change; default: as the scenario says"
    )
    parser.add_argument(
        "--mean", type=positive_number, metavar="N", help="wanted mean force [N]; default: as the scenario says"
    )
    parser.add_argument("--tolerance", type=positive_number, metavar="N", help="how near is enough [N], default 0.1")
    parser.add_argument("--dry-run", action="store_true", help="do not store the value")


def add_study(verbs: Any) -> None:
    """Declare ``study`` and its options."""
    parser = add_verb(
        verbs,
        "study",
        "run a family of variants of a scenario and report them side by side",
        _later("study_command", "study_verb"),
    )
    parser.add_argument("name", nargs="?", metavar="NAME", help="study, or folder of its scenario; not with --list")
    parser.add_argument("--list", action="store_true", help="list the studies and their variants and run nothing")
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="VARIANT",
        help="run only this variant; may be repeated",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: results/study/NAME")
    parser.add_argument("--again", action="store_true", help="run again what an earlier study finished")
    parser.add_argument(
        "--calibrate",
        action="store_true",
        help="first find and store the static forces for the wanted mean",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress, no tables; files and exit code only")
    parser.add_argument("--json", action="store_true", help="print study.json instead of tables")
    parser.add_argument("--no-build", action="store_true", help="do not build missing or stale FMUs")


def add_sweep(verbs: Any) -> None:
    """Declare ``sweep`` and its options."""
    parser = add_verb(
        verbs,
        "sweep",
        "run a scenario over a grid, a sample or a table of values",
        _later("sweep_command", "sweep_verb"),
        scenario=True,
    )
    _add_values(parser)
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: results/sweep/NAME")
    parser.add_argument("--keep", choices=KEPT, help="what stays of the runs beside the table; default: figures")
    text = "what makes the runs: their FMUs (default), or many side by side without FMUs, for lumped pantographs"
    parser.add_argument("--engine", choices=ENGINES, help=text)
    text = "with --engine lanes: runs that are made as FMUs as well, to compare; default: 1"
    parser.add_argument("--check", type=_count_or_none, metavar="N", help=text)
    _add_engine(parser)
    parser.add_argument("--again", action="store_true", help="also make the runs again that failed")
    parser.add_argument("--dry-run", action="store_true", help="check everything and say how many runs there are")
    parser.add_argument("--quiet", action="store_true", help="no progress; files and exit code only")
    parser.add_argument("--json", action="store_true", help="print sweep.json")


def _count_or_none(text: str) -> int:
    return 0 if text == "0" else _count(text)


def add_optimise(verbs: Any) -> None:
    """Declare ``optimise`` and its options."""
    parser = add_verb(
        verbs,
        "optimise",
        "find the values of a few parameters for which a figure is least or greatest",
        _later("optimise_command", "optimise_verb"),
        scenario=True,
    )
    goal = parser.add_mutually_exclusive_group(required=True)
    goal.add_argument("--minimise", metavar="FIGURE", help="the figure that shall be least, e.g. sigma")
    goal.add_argument("--maximise", metavar="FIGURE", help="the figure that shall be greatest")
    bounds: dict[str, Any] = {"action": "append", "default": [], "type": _assignment, "required": True}
    text = "bounds of a parameter, e.g. 2:12kN/m; may be repeated"
    parser.add_argument("--vary", metavar="NAME=LOW:HIGH", help=text, **bounds)
    text = "mean=157.5N (by the static force), maximum<=350N, minimum>=0N; may be repeated"
    parser.add_argument("--subject-to", action="append", default=[], metavar="CONSTRAINT", help=text)
    parser.add_argument("--mean-tolerance", type=positive_number, metavar="N", help="how near is enough; default 0.2")
    parser.add_argument("--max-runs", type=_count, metavar="N", help="most points that are tried; default 60")
    parser.add_argument("--seed", type=int, metavar="S", help="of the search; default 1")
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: results/optimise/NAME")
    _add_engine(parser)
    parser.add_argument("--again", action="store_true", help="also make the runs again that failed")
    parser.add_argument("--dry-run", action="store_true", help="check everything and run nothing")
    parser.add_argument("--quiet", action="store_true", help="no progress; files and exit code only")
    parser.add_argument("--json", action="store_true", help="print optimise.json")


def _add_engine(parser: argparse.ArgumentParser) -> None:
    """Declare who makes the runs."""
    parser.add_argument("--jobs", type=_count, metavar="N", help="make N runs at a time, in processes of this computer")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="make the runs on the workers of this Dask scheduler")
    parser.add_argument("--memory-limit", default="auto", metavar="SIZE", help="of each process with --jobs, e.g. 2GB")
    parser.add_argument(
        "--renew-after", type=_count, default=200, metavar="K", help="runs after which a process is renewed"
    )


def _add_values(parser: argparse.ArgumentParser) -> None:
    def assigned(option: str, values: str, text: str) -> None:
        parser.add_argument(option, action="append", default=[], type=_assignment, metavar=f"NAME={values}", help=text)

    assigned("--over", "A,B,..|FIRST:LAST:STEP", "values of a grid; may be repeated")
    assigned("--vary", "DISTRIBUTION", "e.g. normal(20kN, 0.2kN), uniform(a, b); needs --samples; may be repeated")
    parser.add_argument("--samples", type=_count, metavar="N", help="number of samples of what varies")
    parser.add_argument("--seed", type=int, metavar="S", help="of the samples; default 1")
    parser.add_argument("--method", choices=SAMPLINGS, help="Latin hypercube (default) or Sobol sequence")
    text = "which parameters matter: blocks of runs for Sobol indices, or Morris' trajectories; --samples says how many"
    parser.add_argument("--sensitivity", choices=SENSITIVITIES, help=text)
    parser.add_argument("--from-csv", type=Path, metavar="FILE", help="a row for each run, a column for each parameter")
    text = "each dropper of --span breaks in turn, or each steady arm at its ends comes off; the first run has no fault"
    parser.add_argument("--faults", type=_faults, metavar="each-dropper|each-arm", default=(), help=text)
    parser.add_argument("--span", type=spans, metavar="K,..", default=(), help="span of the line from 1, or several")
    parser.add_argument("--static-force", metavar="'F0 N + c v^2'", help="static force over the speed v in km/h")
    parser.add_argument("--mean-force", metavar="'F0 N + c v^2'", help="mean force that the static force is found for")
    parser.add_argument("--mean-tolerance", type=positive_number, metavar="N", help="how near is enough; default 0.2")


def _assignment(text: str) -> tuple[str, str]:
    name, sign, value = text.partition("=")
    if not (name.strip() and sign and value.strip()):
        raise argparse.ArgumentTypeError(f"'{text}' must be written NAME=VALUES")
    return name.strip(), value.strip()


def _count(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number above 0")
    return value


def add_compare(verbs: Any) -> None:
    """Declare ``compare`` and its options."""
    parser = add_verb(verbs, "compare", "show two or more runs side by side", _later("report_commands", "compare_verb"))
    parser.add_argument("first", type=Path, metavar="RUN", help="results folder")
    parser.add_argument("others", type=Path, metavar="RUN", nargs="+", help="results folders")
    parser.add_argument("--report", type=Path, metavar="FILE", help="write a report in HTML")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


def add_report(verbs: Any) -> None:
    """Declare ``report`` and its options."""
    text = "write plots and report of a run or a sweep again, with a measurement or a film of a run on request"
    parser = add_verb(verbs, "report", text, _later("report_commands", "report_verb"))
    parser.add_argument("run", type=Path, metavar="RUN", help="results folder of a run or a sweep")
    parser.add_argument("--measured", type=Path, metavar="FILE", help="CSV of a measured contact force to compare with")
    parser.add_argument(
        "--measured-offset",
        type=finite_number,
        metavar="D",
        help="added to the measured positions [m] or times [s]; where they fall, the track position is D less them",
    )
    parser.add_argument("--contact", type=int, default=1, metavar="N", help="which contact was measured, default 1")
    add_figures(parser)
    parser.add_argument("--film", type=Path, metavar="FILE", help="write the moving picture as .gif or .mp4")
    parser.add_argument(
        "--magnify", type=positive_number, default=8.0, metavar="N", help="of deformations in the film, default 8"
    )
    parser.add_argument("--parquet", action="store_true", help="also write the time series as Parquet")


def add_verify(verbs: Any) -> None:
    """Declare ``verify`` and its options."""
    parser = add_verb(
        verbs, "verify", "run reference cases and judge every figure", _later("verify_command", "verify_verb")
    )
    parser.add_argument("cases", nargs="*", metavar="CASE", help="name of a case, or a case file; default: all")
    parser.add_argument("--list", action="store_true", help="list the cases and run nothing")
    parser.add_argument(
        "--out", type=Path, default=Path("results/verify"), metavar="DIR", help="default: results/verify"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress, no tables; page and exit code only")
    parser.add_argument("--json", action="store_true", help="print verify.json instead of tables")
    parser.add_argument("--no-build", action="store_true", help="do not build missing or stale FMUs")


def add_verb(
    verbs: Any, name: str, text: str, verb: Callable[..., int], scenario: bool = False
) -> argparse.ArgumentParser:
    """Declare a verb and what carries it out; return the parser of its options."""
    parser: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text)
    parser.set_defaults(verb=verb)
    if scenario:
        text = "folder NAME.ssp/, archive NAME.ssp, folder of a project, or name of a scenario in the library"
        parser.add_argument("scenario", type=Path, metavar="SCENARIO", help=text)
        parser.add_argument("--no-build", action="store_true", help="do not build missing or stale FMUs")
    return parser


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """Declare what may be changed of a scenario, and how strictly it is read."""
    parser.add_argument("--strict", action="store_true", help="treat warnings of the scenario as errors")
    parser.add_argument(
        "--allow-outside",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="let the scenario name files in this folder outside it, such as FMUs that scenarios share",
    )
    parser.add_argument("--stop", type=finite_number, metavar="T", help="stop time [s]")
    parser.add_argument("--step", type=positive_number, metavar="H", help="macro step [s]")
    parser.add_argument("--scheme", choices=SCHEMES, help="coupling scheme")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=assignment,
        metavar="COMPONENT.PARAMETER=VALUE",
        help="change a parameter",
    )


def add_tolerance(parser: argparse.ArgumentParser) -> None:
    """Declare the tolerance for all FMUs."""
    text = "relative tolerance for all FMUs, default: that of their default experiments"
    parser.add_argument("--tolerance", dest="fmu_tolerance", type=positive_number, metavar="R", help=text)


def add_figures(parser: argparse.ArgumentParser) -> None:
    """Declare the formats of the charts' files."""
    text = "charts as png (the default) or svg; once for each format"
    parser.add_argument("--figures", action="append", default=[], choices=FORMATS, help=text)


def finite_number(text: str) -> float:
    """Return an argument as a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text or not text.isascii():
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number{number_advice(text)}")
    return value


def _faults(text: str) -> str | tuple[int, ...]:
    """Return of what there are faults; a list of spans alone is that of their droppers."""
    if text in FAULTS_OF or text[:1].isdigit():
        return text if text in FAULTS_OF else spans(text)
    raise argparse.ArgumentTypeError(f"'{text}' is none of {', '.join(FAULTS_OF)}{hint(text, FAULTS_OF)}")


def spans(text: str) -> tuple[int, ...]:
    """Return the numbers of spans in a list such as ``14,15``, for argparse."""
    numbers = text.split(",")
    if not all(n.strip().isascii() and n.strip().isdigit() and 0 < int(n) < 10_000 for n in numbers):
        raise argparse.ArgumentTypeError(f"'{text}' is no list of spans, such as 14 or 14,15, counted from 1")
    return tuple(dict.fromkeys(int(n) for n in numbers))


def positive_number(text: str) -> float:
    """Return an argument as a number above 0."""
    value = finite_number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"'{text}' must be greater than 0")
    return value


def assignment(text: str, form: str = "COMPONENT.PARAMETER=VALUE") -> tuple[str, str]:
    """Return name and value of an argument, which has this form."""
    name, sign, value = text.partition("=")
    if not (name and sign and value):
        raise argparse.ArgumentTypeError(f"'{text}' must be written {form}")
    return name, value


def _later(module: str, function: str) -> Callable[[argparse.Namespace], int]:
    """Return what carries out a verb; its module is imported when that is called."""

    def verb(options: argparse.Namespace) -> int:
        return int(getattr(importlib.import_module(f"master.commands.{module}"), function)(options))

    return verb
