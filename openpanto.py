"""The installed command ``openpanto``: hands each verb to the package that owns it.

The only file that knows all three packages. A verb's options are declared by its package, which is imported when the
verb is asked for and not before: so ``--version`` and ``--help`` are quick, and an interrupt during the imports ends in
a sentence, like every other one (`master.safety.supervision`).
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, NoReturn

from master.errors import hint
from master.safety.supervision import phase, supervised


class Verb(NamedTuple):
    """A verb: what it does, what declares its options and what carries it out (``module:function``), examples."""

    text: str
    declaration: str
    execution: str
    examples: tuple[str, ...]


_MASTER: Final = "master.commands.main:carry_out"
_MODELS: Final = "models.commands.physics_main:carry_out"
_FMUS: Final = "fmus.__main__:carry_out"

#: Packages that nothing works without, as pyproject.toml has them.
REQUIRED: Final = ("numpy", "scipy", "pythonfmu", "fmpy", "lxml", "pydantic", "filelock", "rich", "matplotlib")

#: In the order of the help.
VERBS: Final[Mapping[str, Verb]] = {
    "run": Verb(
        "run a scenario",
        "master.commands.run_command:add_run",
        _MASTER,
        ("run cx_ln2", "run demo --set catenary.contact_wire.tension='20 kN' --out results/20kN"),
    ),
    "validate": Verb(
        "check a scenario without running it",
        "master.commands.scenario_commands:add_validate",
        _MASTER,
        ("validate demo", "validate theirs.ssp --strict"),
    ),
    "pack": Verb(
        "write a scenario as a .ssp archive, FMUs included",
        "master.commands.scenario_commands:add_pack",
        _MASTER,
        ("pack cx_ln2", "pack demo --standalone --out demo.ssp"),
    ),
    "calibrate": Verb(
        "find the parameter value that gives the wanted mean force, and store it in the scenario",
        "master.commands.calibrate_command:add_calibrate",
        _MASTER,
        ("calibrate demo", "calibrate demo --parameter pantograph.static_force --mean 120 --dry-run"),
    ),
    "study": Verb(
        "run a family of variants of a scenario and report them side by side",
        "master.commands.study_command:add_study",
        _MASTER,
        ("study --list", "study cx_ln2_overlap", "study cx_generic_pair --only distance_100"),
    ),
    "sweep": Verb(
        "run a scenario over a grid, a sample or a table of values",
        "master.commands.sweep_command:add_sweep",
        _MASTER,
        (
            "sweep cx_ln2 --over speed=200:320:10",
            "sweep demo --samples 200 --vary 'catenary.contact_wire.tension=normal(20kN, 0.2kN)' --jobs 4",
        ),
    ),
    "compare": Verb(
        "show two or more runs side by side",
        "master.commands.report_commands:add_compare",
        _MASTER,
        ("compare results/demo results/20kN", "compare results/demo results/20kN --report compare.html"),
    ),
    "report": Verb(
        "write plots and report of a run again, with a measurement or a film on request",
        "master.commands.report_commands:add_report",
        _MASTER,
        ("report results/demo", "report results/demo --measured force.csv --film run.mp4"),
    ),
    "verify": Verb(
        "run reference cases and judge every figure",
        "master.commands.verify_command:add_verify",
        _MASTER,
        ("verify --list", "verify cx_ln2", "verify"),
    ),
    "statics": Verb(
        "static shape, droppers, elasticity and wave figures of a line",
        "models.commands.statics_command:add",
        _MODELS,
        ("statics LN2", "statics demo/lines/demo_LN2.toml --speed 250 --out statics"),
    ),
    "pantograph": Verb(
        "statics over height, modes, apparent mass of a pantograph",
        "models.commands.pantograph_command:add",
        _MODELS,
        ("pantograph CX", "pantograph CX_multibody --heights 4.8 5.4 --out pantograph"),
    ),
    "identify": Verb(
        "fit a lumped pantograph to a frequency response",
        "models.commands.identify_command:add",
        _MODELS,
        ("identify response.csv", "identify response.csv --stages 2 --fix m2=7.75 --plot fit.png"),
    ),
    "couple": Verb(
        "run a lumped pantograph on a line as one system, without co-simulation",
        "models.commands.couple_command:add",
        _MODELS,
        ("couple LN2 CX", "couple LN2 CX --speed 280 --interval 400 700 --out coupled"),
    ),
    "build": Verb(
        "build FMUs, by default all of the library",
        "fmus.__main__:add_build",
        _FMUS,
        ("build Catenary_LN2 Pantograph_CX", "build demo/lines/demo_LN2.toml --out fmus --standalone"),
    ),
    "doctor": Verb(
        "report what this machine lacks, to run at all or to run an FMU",
        "openpanto:add_doctor",
        _FMUS,
        ("doctor", "doctor build/fmus/Catenary_LN2.fmu"),
    ),
}


class Parser(argparse.ArgumentParser):
    """A parser that suggests what a mistyped option or choice may have been meant to be."""

    def error(self, message: str) -> NoReturn:
        """Print the usage and the mistake, and end with exit code 2."""
        if found := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message, re.DOTALL):
            message += hint(found[1], re.findall(r"'(.*?)'", found[2]))
        super().error(message)

    def unknown(self, given: Sequence[str]) -> NoReturn:
        """Refuse arguments that the verb does not have."""
        options = [option for action in self._actions for option in action.option_strings]
        text = f"unrecognized arguments: {' '.join(given)}"
        self.error(text + (hint(given[0].partition("=")[0], options) if given[0].startswith("-") else ""))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return the exit code: 0 done, 1 failed, 2 a command line that was not understood."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    return supervised(lambda: _worked(given))


def _worked(given: Sequence[str]) -> int:
    """Carry out a command line, having imported what its verb needs."""
    verb = given[0] if given else ""
    parser = command_line([verb])
    if not verb:
        parser.print_help()
        return 2
    if not verb.startswith("-") and verb not in VERBS:
        parser.error(f"there is no verb '{verb}'{hint(verb, VERBS) or _wanted_run(verb)}")
    options, unknown = parser.parse_known_args(given)
    if unknown:
        options.parser.unknown(unknown)
    with phase("computing"):  # a factorisation may never come back to Python
        return int(_named(VERBS[verb].execution)(options))


def _wanted_run(name: str) -> str:
    """Return the hint that a scenario is run by a verb, if the name may be one."""
    return f"; to run a scenario: openpanto run {name}" if os.path.lexists(name) or name.endswith(".ssp") else ""


def command_line(wanted: Collection[str] = tuple(VERBS)) -> Parser:
    """Return the parser of the command line, with the options of the wanted verbs and the names of all."""
    parser = Parser(
        prog="openpanto",
        description="Simulate pantographs under overhead contact lines and judge the contact quality.",
        epilog="openpanto VERB --help says more of a verb. Start with: openpanto run cx_ln2",
    )
    parser.add_argument("--version", action="version", version=f"openpanto {_version() or '(not installed)'}")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=Parser)
    for name, verb in VERBS.items():
        if name not in wanted:
            verbs.add_parser(name, help=verb.text, add_help=False)
            continue
        _named(verb.declaration)(verbs)
        added = verbs.choices[name]
        added.description = verb.text
        added.epilog = "\n".join(["examples:", *(f"  openpanto {example}" for example in verb.examples)])
        added.formatter_class = argparse.RawDescriptionHelpFormatter
        added.set_defaults(parser=added)
    return parser


def _version(package: str = "openpanto") -> str:
    """Return the version of an installed package, empty if it is not there."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _named(place: str) -> Callable[..., Any]:
    """Return a function by ``module:name``."""
    module, _, name = place.partition(":")
    found: Callable[..., Any] = getattr(importlib.import_module(module), name)
    return found


def add_doctor(verbs: Any) -> None:
    """Declare ``doctor``: of this machine, or of an FMU on it."""
    parser = verbs.add_parser("doctor", help=VERBS["doctor"].text)
    parser.add_argument("fmu", nargs="?", type=Path, metavar="FILE", help="X.fmu; without it, the machine is examined")
    parser.set_defaults(run=_examine)


def _examine(options: argparse.Namespace) -> int:
    """Print what is there and what lacks; return 1 if something is missing."""
    from fmus.loader import doctor

    if options.fmu is not None:
        return doctor.main(options.fmu)
    found = [doctor.Finding(*finding) for finding in (*_packages(), _kernels())]
    return doctor.show([doctor.Finding("ok", f"openpanto {_version()}"), *doctor.examine_machine(), *found])


def _packages() -> Iterator[tuple[Literal["ok", "note", "missing"], str]]:
    for name in REQUIRED:
        version = _version(name)
        yield ("ok", f"{name} {version}") if version else ("missing", f"{name} lacks: pip install {name}")


def _kernels() -> tuple[Literal["ok", "note", "missing"], str]:
    from models.catenary.step.engine_choice import kernels

    try:
        kernels()
    except ImportError as error:
        return "note", f"lines are stepped by NumPy, slower than by compiled kernels: {error}"
    return "ok", f"lines are stepped by compiled kernels (numba {_version('numba')})"


if __name__ == "__main__":
    sys.exit(main())
