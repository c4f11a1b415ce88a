"""The installed command ``openpanto``: hands each verb to the package that owns it.

The only file that knows all three packages. A verb's options are declared by its package, which is imported when the
verb is asked for and not before: so ``--version`` and ``--help`` are quick, and an interrupt during the imports ends in
a sentence, like every other one (`master.safety.supervision`). The table of verbs and ``new``, which takes from all
packages, make it longer than other files.
"""

from __future__ import annotations

import os
import signal
import sys


def _end(*_: object) -> None:
    """End this process with a sentence."""
    processes = sys.modules.get("multiprocessing.process")
    if processes is None or processes.parent_process() is None:  # the command says it, not each of its processes
        os.write(2, b"error: interrupted\n")
    os._exit(1)


if os.path.basename(sys.argv[0]).partition(".")[0] == "openpanto":  # the command, which supervision is yet to begin for
    for _signal in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(_signal) != signal.SIG_IGN:  # as under nohup
            signal.signal(_signal, _end)
if __name__ == "__main__" and sys.path[0] != os.path.dirname(__file__) and not sys.flags.safe_path:
    del sys.path[0]  # the working folder of ``python -m openpanto``

import argparse
import importlib
import importlib.util
import re
import shlex
import textwrap
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, NoReturn

for _name in ("master", "models", "fmus"):  # PYTHONPATH comes before what is installed
    _found = importlib.util.find_spec(_name)
    _file = "" if _found is None else os.path.abspath(_found.origin or "")
    if _file and _file != os.path.join(os.path.dirname(os.path.abspath(__file__)), _name, "__init__.py"):
        sys.exit(f"error: {_file} stands before our package '{_name}': take its folder out of PYTHONPATH")

from master.errors import empty_argument, hint, said
from master.safety.supervision import phase, supervised


class Verb(NamedTuple):
    """A verb: what it does, what declares its options and what carries it out (``module:function``), examples."""

    text: str
    declaration: str
    execution: str
    examples: tuple[str, ...]


_MASTER: Final = "master.commands.verb_execution:carry_out"
_MODELS: Final = "models.commands.physics_main:carry_out"
_FMUS: Final = "fmus.__main__:carry_out"

#: Packages that nothing works without, as pyproject.toml has them.
REQUIRED: Final = ("numpy", "scipy", "pythonfmu", "fmpy", "lxml", "pydantic", "filelock", "rich", "matplotlib", "shtab")

#: In the order of the help.
VERBS: Final[Mapping[str, Verb]] = {
    "run": Verb(
        "run a scenario",
        "master.commands.verb_options:add_run",
        _MASTER,
        ("run cx_ln2", "run demo --set catenary.contact_wire.tension='20 kN' --out results/20kN"),
    ),
    "new": Verb(
        "write a project: a scenario of a line and pantographs, and copies of their definitions to edit",
        "openpanto:add_new",
        _MASTER,
        (
            "new demo --line LN2 --pantograph DSA380 --speed 250",
            "new train --line LN2 --pantograph CX --pantograph CX --separation 100 --speed 300",
            "new theirs --line LN2 --pantograph Theirs.fmu --map contact.force=push --speed 300",
        ),
    ),
    "new-line": Verb(
        "copy the definition of a line, under a new name, into the project",
        "openpanto:add_new_line",
        _MASTER,
        ("new-line my_line --like LN2",),
    ),
    "new-pantograph": Verb(
        "copy the definition of a pantograph, under a new name, into the project",
        "openpanto:add_new_pantograph",
        _MASTER,
        ("new-pantograph my_pantograph --like CX",),
    ),
    "validate": Verb(
        "check a scenario without running it",
        "master.commands.verb_options:add_validate",
        _MASTER,
        ("validate demo", "validate theirs.ssp --strict"),
    ),
    "pack": Verb(
        "write a scenario as a .ssp archive, FMUs included",
        "master.commands.verb_options:add_pack",
        _MASTER,
        ("pack cx_ln2", "pack demo --standalone --out demo.ssp"),
    ),
    "calibrate": Verb(
        "find the parameter value that gives the wanted mean force, and store it in the scenario",
        "master.commands.verb_options:add_calibrate",
        _MASTER,
        ("calibrate demo", "calibrate demo --parameter pantograph.static_force --mean 120 --dry-run"),
    ),
    "study": Verb(
        "run a family of variants of a scenario and report them side by side",
        "master.commands.verb_options:add_study",
        _MASTER,
        ("study --list", "study cx_ln2_overlap", "study cx_ln2_overlap --only '200 m'"),
    ),
    "sweep": Verb(
        "run a scenario over a grid, a sample or a table of values",
        "master.commands.verb_options:add_sweep",
        _MASTER,
        (
            "sweep cx_ln2 --over speed=200:320:10",
            "sweep demo --samples 200 --vary 'catenary.contact_wire.tension=normal(20kN, 0.2kN)' --jobs 4",
        ),
    ),
    "optimise": Verb(
        "find the values of a few parameters for which a figure is least or greatest",
        "master.commands.verb_options:add_optimise",
        _MASTER,
        ("optimise cx_ln2 --minimise sigma --vary 'pantograph.stage[3].stiffness=2:12kN/m' --subject-to mean=157N",),
    ),
    "compare": Verb(
        "show two or more runs side by side",
        "master.commands.verb_options:add_compare",
        _MASTER,
        ("compare results/demo results/20kN", "compare results/demo results/20kN --report compare.html"),
    ),
    "report": Verb(
        "write plots and report of a run or a sweep again, with a measurement or a film of a run on request",
        "master.commands.verb_options:add_report",
        _MASTER,
        ("report results/demo", "report results/demo --measured force.csv --film run.mp4"),
    ),
    "verify": Verb(
        "run reference cases and judge every figure",
        "master.commands.verb_options:add_verify",
        _MASTER,
        ("verify --list", "verify cx_ln2", "verify"),
    ),
    "statics": Verb(
        "static shape, droppers, elasticity and wave figures of a line",
        "models.commands.physics_verbs:add_statics",
        _MODELS,
        (
            "statics LN2",
            "statics demo/lines/demo_LN2.toml --speed 250 --out statics",
            "statics CA160 --wind 29 --head 1950 --out statics",
        ),
    ),
    "spans": Verb(
        "smallest radius for a span, largest span for a radius, in the wind",
        "models.commands.physics_verbs:add_spans",
        _MODELS,
        ("spans LN2 --wind 29 --limit 0.4", "spans CA160 --pressure 961 --head 1950 --stagger 0.2 0.2 --out spans"),
    ),
    "asbuilt": Verb(
        "a line as it hangs, from a measuring run, and which droppers to correct",
        "models.commands.physics_verbs:add_asbuilt",
        _MODELS,
        (
            "asbuilt LN2 run.csv --out asbuilt",
            "asbuilt demo/lines/demo_LN2.toml run.xlsx --out asbuilt --tolerance 8 --step 2 --only 20",
        ),
    ),
    "import": Verb(
        "make the definition of a line from its layout, tables as CSV or XLSX",
        "models.commands.physics_verbs:add_import",
        _MODELS,
        ("import layout --out lines/station.toml", "import survey.xlsx --design LN2 --out lines/survey.toml"),
    ),
    "export": Verb(
        "write the layout of a line, with the lengths of its droppers",
        "models.commands.physics_verbs:add_export",
        _MODELS,
        ("export LN2 --out layout", "export lines/station.toml --out workshop --xlsx"),
    ),
    "pantograph": Verb(
        "statics over height, modes, apparent mass of a pantograph",
        "models.commands.physics_verbs:add_pantograph",
        _MODELS,
        ("pantograph CX", "pantograph CX_multibody --heights 4.8 5.4 --out pantograph"),
    ),
    "identify": Verb(
        "fit a lumped pantograph to a frequency response",
        "models.commands.physics_verbs:add_identify",
        _MODELS,
        ("identify response.csv", "identify response.csv --stages 2 --fix m2=7.75 --plot fit.png"),
    ),
    "couple": Verb(
        "run a lumped pantograph on a line as one system, without co-simulation",
        "models.commands.physics_verbs:add_couple",
        _MODELS,
        ("couple LN2 CX", "couple LN2 CX --speed 280 --interval 400 700 --out coupled"),
    ),
    "build": Verb(
        "build FMUs, by default all of the library",
        "fmus.__main__:add_build",
        _FMUS,
        ("build Catenary_LN2 Pantograph_CX", "build demo/lines/demo_LN2.toml --out fmus --standalone"),
    ),
    "signal": Verb(
        "build an FMU that plays back a table of signals over time",
        "fmus.__main__:add_signal",
        _FMUS,
        (
            "signal roof.csv --rate base.z=base.vz",
            "signal speed.csv --integral train.vx=train.x",
        ),
    ),
    "doctor": Verb(
        "report what this machine lacks, to run at all or to run an FMU",
        "openpanto:add_doctor",
        _FMUS,
        ("doctor", "doctor build/fmus/Catenary_LN2.fmu"),
    ),
}


#: Columns that help takes.
_WIDTH: Final = 80
EPILOG: Final = """\
openpanto VERB --help says more of a verb and has examples. To begin with:
  openpanto run cx_ln2
Completion with TAB, in bash (zsh, fish likewise):
  openpanto --completion bash > ~/.local/share/bash-completion/completions/openpanto"""


class Parser(argparse.ArgumentParser):
    """A parser that suggests what a mistyped option or choice may have been meant to be."""

    _given: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse arguments, and keep them for `error`."""
        self._given = list(sys.argv[1:] if args is None else args)
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Print the mistake in one sentence, and end with exit code 2."""
        if found := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message, re.DOTALL):
            message += hint(found[1], re.findall(r"'(.*?)'", found[2]))
        if "required" in message:
            if mistyped := [text for text in self._given if self.is_no_option(text)]:
                self._given = ()
                self.unknown(mistyped)
            message += f" ({self.prog} --help has examples)"
        self.exit(2, f"{self.prog}: error: {message}\n")

    def is_no_option(self, text: str) -> bool:
        """Whether an argument is written as an option, and neither is one nor the beginning of one."""
        name, known = text.partition("=")[0], self._option_string_actions
        is_written_so = re.match(r"--?[a-zA-Z]", name) is not None
        return is_written_so and not any(option.startswith(name) for option in known)

    def unknown(self, given: Sequence[str]) -> NoReturn:
        """Refuse arguments that the verb does not have."""
        options = [option for action in self._actions for option in action.option_strings]
        text = f"unrecognized arguments: {' '.join(given)}"
        self.error(text + (hint(given[0].partition("=")[0], options) if given[0].startswith("-") else ""))


class Completion(argparse.Action):
    """Prints the script that completes verbs, options, names and files in a shell, and ends.

    It is made once and holds all it needs: pressing TAB starts no Python.
    """

    def __call__(self, parser: argparse.ArgumentParser, _namespace: object, shell: Any, _option: object = None) -> None:
        """Print the script."""
        try:
            print(completion(shell), flush=True)
        except ModuleNotFoundError as error:
            parser.exit(1, f"error: {error.name} is not installed: pip install {error.name}\n")
        except BrokenPipeError:  # the reader has closed it, and knows
            raise
        except OSError as error:
            parser.exit(1, f"error: standard output: {said(error)}\n")
        parser.exit()


def completion(shell: Literal["bash", "zsh", "fish"]) -> str:
    """Return the script for a shell, with the names of the library as they are now."""
    import shtab

    from fmus.builder.recipe import known_names
    from master.batch import verification
    from master.scenario import scenario_place
    from models.library.search_path import LIBRARY, definition_names

    lines, pantographs = definition_names("lines", [LIBRARY]), definition_names("pantographs", [LIBRARY])
    known = {
        "scenario": scenario_place.scenario_names(),
        "line": lines,
        "design": lines,
        "pantograph": pantographs,
        "like": (*lines, *pantographs),
        "name": [study.parent.stem for study in scenario_place.LIBRARY.glob("*.ssp/study.toml")],
        "cases": [case.stem for case in (Path(verification.__path__[0]) / "cases").glob("*.toml")],
        "names": known_names(),
    }
    parser, functions = command_line(), []
    for verb in _verbs(parser).values():
        for action in verb._actions:
            if action.dest in known and action.choices is None:
                name = f"_openpanto_{verb.prog.split()[-1].replace('-', '_')}_{action.dest}"
                functions.append(_COMPLETING[shell].format(name=name, known=" ".join(sorted(known[action.dest]))))
                action.complete = {"bash": name, "zsh": name, "fish": f"({name})"}  # type: ignore[attr-defined]
            elif action.type is Path:
                is_folder = action.metavar == "DIR"
                action.complete = shtab.DIRECTORY if is_folder else shtab.FILE  # type: ignore[attr-defined]
    preamble: Any = {shell: "\n".join(functions)}
    return str(shtab.complete(parser, shell, preamble=preamble))


#: Shell functions that offer known names, and files as well.
_COMPLETING: Final = {
    "bash": '{name}() {{ compgen -W "{known}" -- "$1"; compgen -f -- "$1"; }}',
    "zsh": "{name}() {{ compadd {known}; _files; }}",
    "fish": "function {name}; string split ' ' '{known}'; __fish_complete_path (commandline -ct); end",
}


def _verbs(parser: argparse.ArgumentParser) -> Mapping[str, argparse.ArgumentParser]:
    """Return the parsers of the verbs."""
    return next(a.choices for a in parser._actions if isinstance(a, argparse._SubParsersAction))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return the exit code: 0 done, 1 failed, 2 a command line that was not understood."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    return supervised(lambda: _understood(given))


def _understood(given: Sequence[str]) -> int:
    """Carry out a command line; say what is wrong if that fails with a package that PYTHONPATH has put in the way."""
    try:
        return _worked(given)
    except Exception as error:
        if not (foreign := list(_from_python_path())):
            raise
        text = f"{', '.join(foreign)} instead of what is installed, by PYTHONPATH, does not do ({error})"
        print(f"error: {text}: take its folder out of PYTHONPATH", file=sys.stderr)
        return 1


def _from_python_path() -> Iterator[str]:
    """Yield the files that packages which we need come from, those in the folders of PYTHONPATH."""
    folders = [Path(name).resolve() for name in os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    for name in REQUIRED:
        file = getattr(sys.modules.get(name), "__file__", None)
        if file is not None and any(Path(file).resolve().parent in (f, f / name) for f in folders):
            yield file


def _worked(given: Sequence[str]) -> int:
    """Carry out a command line, having imported what its verb needs."""
    verb = given[0] if given else ""
    parser = command_line([verb])
    if not given:
        parser.print_help()
        return 2
    if empty := empty_argument(given):
        parser.error(empty)
    if parser.is_no_option(verb):
        parser.unknown([verb])
    if not verb.startswith("-") and verb not in VERBS:
        parser.error(f"there is no verb '{verb}'{_wanted_verb(parser, verb)}")
    options, unknown = parser.parse_known_args(given)
    if unknown:
        options.parser.unknown(unknown)
    execution = VERBS[verb].execution
    # The master says itself what it is at; of the physics, a factorisation may never come back to Python.
    with nullcontext() if execution == _MASTER else phase("computing"):
        return int(_named(execution)(options))


def _wanted_verb(parser: Parser, name: str) -> str:
    """Return the hint what may be meant by a word that is no verb: an option, a scenario to run, a verb like it."""
    from master.scenario.scenario_place import scenario_names

    is_scenario = os.path.lexists(name) or name.endswith(".ssp") or name in scenario_names()
    if is_scenario:
        return f"; to run a scenario: openpanto run {name}"
    if f"--{name}" in parser._option_string_actions:
        return f"; it is an option: openpanto --{name}"
    return hint(name, VERBS) or "; openpanto --help lists them"


def command_line(wanted: Collection[str] = tuple(VERBS)) -> Parser:
    """Return the parser of the command line, with the options of the wanted verbs and the names of all."""
    parser = Parser(
        prog="openpanto",
        description="Simulate pantographs under overhead contact lines and judge the contact quality.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"openpanto {_version() or '(not installed)'}")
    parser.add_argument(
        "--completion", action=Completion, choices=("bash", "zsh", "fish"), help="print a script for TAB"
    )
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=Parser)
    for name, verb in VERBS.items():
        if name not in wanted:
            verbs.add_parser(name, help=verb.text, add_help=False)
            continue
        _named(verb.declaration)(verbs)
        added = verbs.choices[name]
        added.description = textwrap.fill(verb.text, _WIDTH)
        added.epilog = "\n".join(["examples:", *(_on_lines(f"  openpanto {example}") for example in verb.examples)])
        added.formatter_class = argparse.RawDescriptionHelpFormatter
        added.set_defaults(parser=added)
    return parser


def _on_lines(example: str) -> str:
    """Return an example on as many lines as it needs, broken before options as a shell wants it."""
    first, *others = re.split(r" (?=--)", example)
    lines = [first]
    for part in others:
        if len(f"{lines[-1]} {part} \\") <= _WIDTH:
            lines[-1] += f" {part}"
        else:
            lines.append(f"      {part}")
    return " \\\n".join(lines)


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


def add_new(verbs: Any) -> None:
    """Declare ``new`` and its options."""
    from master.commands.verb_options import assignment, finite_number

    parser = verbs.add_parser("new", help=VERBS["new"].text)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="of the project, new or empty")
    what = "name in the library or the project, file NAME.toml, or an FMU, X.fmu"
    parser.add_argument("--line", required=True, metavar="LINE", help=what)
    text = "the same for a pantograph; once for each, the leading one first"
    parser.add_argument("--pantograph", required=True, action="append", metavar="PANTOGRAPH", help=text)
    text = "from one pantograph to the next [m]; once, or once for each gap"
    parser.add_argument("--separation", action="append", type=finite_number, default=[], metavar="M", help=text)
    parser.add_argument("--speed", required=True, type=finite_number, metavar="KM/H", help="of the train [km/h]")
    text = "where figures are taken [m]; by default as many spans as the line has room for, ten at most"
    parser.add_argument("--interval", nargs=2, type=finite_number, metavar=("START", "END"), help=text)
    text = "whose limits apply and whose upper mean force calibrate seeks: AC (default), 'DC 1.5kV', 'DC 3kV'"
    parser.add_argument("--supply", type=_supply, default="AC", metavar="SYSTEM", help=text)
    text = "which variable of an FMU a port is (A.x ... B.vz, contact.force), if its name does not say; repeatable"
    port = partial(assignment, form="PORT=VARIABLE")
    parser.add_argument("--map", action="append", type=port, default=[], metavar="PORT=VARIABLE", help=text)
    parser.set_defaults(verb=_new)


def _supply(text: str) -> str:
    """Return the name that limits have for a supply system."""
    name = text.upper().replace(" ", "").replace("KV", "")
    if name not in ("AC", "DC1.5", "DC3"):
        raise argparse.ArgumentTypeError(f"'{text}' has no limits here: give AC, 'DC 1.5kV' or 'DC 3kV'")
    return name


def add_new_line(verbs: Any) -> None:
    """Declare ``new-line``."""
    _add_copy(verbs, "new-line", "lines")


def add_new_pantograph(verbs: Any) -> None:
    """Declare ``new-pantograph``."""
    _add_copy(verbs, "new-pantograph", "pantographs")


def _add_copy(verbs: Any, verb: str, kind: str) -> None:
    parser = verbs.add_parser(verb, help=VERBS[verb].text)
    parser.add_argument("name", metavar="NAME", help="of the copy: letters, digits and _")
    parser.add_argument("--like", required=True, metavar="NAME", help="name of the original, or its file NAME.toml")
    parser.set_defaults(verb=_copy, kind=kind)


def _new(options: argparse.Namespace) -> int:
    """Write a project."""
    from master.errors import RequestError
    from master.evaluation.en50367_limits import SUPPLIES, LimitChoice, limits_at
    from master.scenario.project import new_project as projects
    from master.scenario.project.stretch import Wire, check_speed
    from master.scenario.scenario_place import scenario_names
    from models.library import definition_facts as facts
    from models.library.catalogue import line_path, load_line, load_pantograph

    _tell_doubts([("lines", options.line), *(("pantographs", name) for name in options.pantograph)])
    projects.check_folder(options.folder)
    check_speed(options.speed / 3.6)
    name, speed = projects.project_name(options.folder), options.speed / 3.6
    wire, lifts, raised = None, {}, 0.0
    line, definition = _source("lines", options.line, name, load_line)
    if definition is not None:
        wire = Wire(options.line, *facts.line_facts(definition))
    train = []
    for given in options.pantograph:
        pantograph, definition = _source("pantographs", given, name, load_pantograph)
        train.append(pantograph)
        if definition is not None:
            if definition.speed_profile is not None:
                raise RequestError(
                    f"{given} has a [speed_profile], and a project begins with the speed that --speed says: leave it "
                    "out, and write it into the copy afterwards in place of the scenario's parameter 'speed'"
                )
            raised = raised if len(train) > 1 else facts.raised_after(definition)
            lifts[pantograph.name] = projects.Lift(*facts.lift_facts(definition))
    target = limits_at(speed, LimitChoice(options.supply)).mean_upper.value
    interval = tuple(options.interval) if options.interval else None
    request = projects.Request(
        options.folder, line, wire, train, lifts, options.separation, speed, target, interval, options.map,
        (options.supply, SUPPLIES[options.supply]), raised,
    )  # fmt: skip
    projects.new_project(request)
    if wire is not None:
        _copy_profile(line_path(options.line), options.folder / "lines" / f"{line.name}.toml")
    if doubt := projects.doubt(request):
        print(f"note: {doubt}", file=sys.stderr)
    if options.folder.name in scenario_names():
        text = f"'{options.folder.name}' is a scenario of the library too; where the project is seen, its own counts"
        print(f"note: {text}", file=sys.stderr)
    page = options.folder / "README.md"
    print(f"wrote {options.folder} for {options.speed:g} km/h; {page} says what each file is and what was chosen")
    print(f"next: openpanto run {shlex.quote(str(options.folder))}")
    return 0


def _source(kind: Any, given: str, project: str, load: Callable[[str], Any]) -> tuple[Any, Any]:
    """Return what is copied into a project, and the definition; of an FMU its path, and None."""
    from master.scenario.project.new_project import Definition

    if given.lower().endswith(".fmu"):
        return Path(given), None
    path, text, definition = _original(kind, given, load)
    name, text = _renamed(path, text, f"{project}_{path.stem}")
    from models.library.search_path import LIBRARY

    origin = f"copy of {path.stem} in the library" if path.is_relative_to(LIBRARY) else f"copy of {path}"
    return Definition(name, text, origin), definition


def _copy(options: argparse.Namespace) -> int:
    """Write a copy of a definition under another name."""
    from master.errors import RequestError
    from master.safety.safe_files import write_atomically
    from models.library import search_path as places
    from models.library.catalogue import load_line, load_pantograph

    _tell_doubts([(options.kind, options.like)])
    load = load_line if options.kind == "lines" else load_pantograph
    path, text, _ = _original(options.kind, options.like, load)
    name, text = _renamed(path, text, options.name)
    if taken := places.definition_files(options.kind, name, [*places.search_path(), places.LIBRARY]):
        raise RequestError(f"{taken[0]} is named '{name}' already: take another name")
    project = places.project_folder(Path())
    copy = (project or Path()) / options.kind / f"{name}.toml"
    copy.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(copy, text.encode(), "another folder to work in")
    _copy_profile(path, copy)
    print(copy)
    if project is None:
        text = f"for other folders, add {Path().resolve()} to {places.VARIABLE}"
        print(f"note: this folder lies in no project, so '{name}' is found from here alone; {text}", file=sys.stderr)
    return 0


def _copy_profile(path: Path, copy: Path) -> None:
    """Have the running surface of a line go along with a copy of its definition."""
    from master.errors import RequestError
    from master.safety.safe_files import write_atomically
    from models.library import definition_copy

    try:
        wanted = definition_copy.profile_of_copy(path, copy)
    except definition_copy.CopyError as error:
        raise RequestError(str(error)) from error
    if wanted is not None:
        wanted[0].parent.mkdir(parents=True, exist_ok=True)
        write_atomically(*wanted, "another folder to work in")


def _original(kind: Any, given: str, load: Callable[[str], Any]) -> tuple[Path, str, Any]:
    """Return file, text and definition of a name."""
    from master.errors import RequestError
    from models.definition_files.toml_reader import DefinitionError
    from models.library import catalogue

    try:
        path = (catalogue.line_path if kind == "lines" else catalogue.pantograph_path)(given)
        definition = load(str(path))  # says what is wrong with the file, if anything is
        return path, path.read_text(encoding="utf-8"), definition
    except (catalogue.UnknownNameError, DefinitionError) as error:
        raise RequestError(str(error)) from error


def _tell_doubts(names: Iterable[tuple[Any, str]]) -> None:
    """Print what deserves a second look about the definitions that are called by these names."""
    from models.library.catalogue import doubts

    found = [text for kind, name in names if not name.lower().endswith(".fmu") for text in doubts(kind, name)]
    for text in dict.fromkeys(found):
        print(f"note: {text}", file=sys.stderr)


def _renamed(path: Path, text: str, name: str) -> tuple[str, str]:
    """Return a name and the text of a definition that has it."""
    from master.errors import RequestError
    from models.library import definition_copy

    try:
        name = definition_copy.checked_name(name)
    except definition_copy.CopyError as error:
        raise RequestError(str(error)) from error
    try:
        return name, definition_copy.renamed(text, name)
    except definition_copy.CopyError as error:
        raise RequestError(f"{path}: {error}") from error


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
        yield ("ok", f"{name} {version}") if version else ("missing", f"{name} is not installed: pip install {name}")


def _kernels() -> tuple[Literal["ok", "note", "missing"], str]:
    from models.catenary.step.engine_choice import kernels

    try:
        kernels()
    except ImportError as error:
        return "note", f"lines are stepped by NumPy, slower than by compiled kernels: {error}"
    return "ok", f"lines are stepped by compiled kernels (numba {_version('numba')})"


if __name__ == "__main__":
    sys.exit(main())
