"""Command line: ``python -m fmus build | signal | runtime | doctor | fingerprint | list``."""

from __future__ import annotations

import os
import sys

# No file in the working folder (rich.py) stands in for a package, unless that folder is where this one was found.
if __name__ == "__main__" and not sys.flags.safe_path and sys.path[0] != __file__[: -len("/fmus/__main__.py")]:
    del sys.path[0]

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from models.definition_files.message_text import empty_argument, printable, said
from models.library.search_path import search_path

# What builds is imported where it is used: help and a mistyped option are answered without NumPy.
if TYPE_CHECKING:
    from fmus.builder.recipe import Recipe
    from fmus.loader.runtime import Runtime

#: Pantograph ports that a line may have, as in `fmus.builder.recipe`.
_MAX_PORTS: Final = 16
#: What may be between the rows of a table, as in `models.numerics.sampled_signal`.
_INTERPOLATIONS: Final = ("held", "linear", "smooth")
DEFAULT_FOLDER = Path("build/fmus")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return 0 for success, 1 for failure, 2 for a command line that was not understood."""
    parser, given = _parser(), sys.argv[1:] if arguments is None else arguments
    if empty := empty_argument(given):
        parser.error(empty)
    return carry_out(parser.parse_args(given))


def carry_out(options: argparse.Namespace) -> int:
    """Carry out a verb that was understood and return the exit code; what a user can cause is one message."""
    from fmus.builder.recipe import BuildError, UnknownFmuError

    try:
        code: int | None = options.run(options)
        if sys.stdout is not None:  # closed by the caller
            sys.stdout.flush()  # here, where an error can still be reported
    except (UnknownFmuError, BuildError) as error:
        return _fail(str(error))
    except BrokenPipeError:  # the reader of the output has closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _fail(f"{error.filename or 'standard output'}: {said(error)}")
    except MemoryError:
        return _fail("there is not enough memory; close other programs, or raise the limit (ulimit -v)")
    except KeyboardInterrupt:
        return _fail("interrupted")
    return code or 0


def _fail(text: str) -> int:
    print(f"error: {printable(text)}", file=sys.stderr)
    return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m fmus", description="Build FMUs and check whether they run here.")
    verbs = parser.add_subparsers(required=True, metavar="COMMAND")
    add_build(verbs)
    add_signal(verbs)
    verb = verbs.add_parser("runtime", help="write the Python that several FMUs share (OPENPANTO_RUNTIME)")
    verb.add_argument("--out", type=Path, default=Path("build/runtime"), metavar="DIR", help="folder (%(default)s)")
    verb.add_argument("--runtime", type=Path, metavar="DIR", help="the Python to take it from (the present one)")
    verb.set_defaults(run=_write_runtime)
    add_doctor(verbs)
    verb = verbs.add_parser("fingerprint", help="print the content hash (GUID) that a build would have now")
    _add_lookup(verb)
    verb.add_argument("name", metavar="NAME", help="as for build")
    verb.add_argument("--if-known", action="store_true", help="print nothing for a name that no FMU has")
    verb.add_argument("--watched", action="store_true", help="list what it depends on as well, as JSON strings")
    verb.set_defaults(run=_fingerprint)
    verb = verbs.add_parser("list", help="list the FMUs that can be built")
    verb.set_defaults(run=_list)
    return parser


def add_build(verbs: Any) -> None:
    """Declare ``build`` and its options."""
    text = "build FMUs, by default all of the library"
    verb = verbs.add_parser("build", help=text, description=text)
    verb.add_argument("names", nargs="*", metavar="NAME", help="Catenary_LN2, Pantograph_CX, path/to/LINE.toml ...")
    verb.add_argument("--out", type=Path, default=DEFAULT_FOLDER, metavar="DIR", help="folder (%(default)s)")
    _add_lookup(verb)
    _add_runtime(verb)
    verb.set_defaults(run=_build)


def add_signal(verbs: Any) -> None:
    """Declare ``signal`` and its options."""
    text = "build an FMU that plays back a table of signals over time"
    verb = verbs.add_parser("signal", help=text, description=text)
    verb.add_argument("file", type=Path, metavar="FILE", help="CSV: 'time [s],name [unit],...', then rows")
    verb.add_argument("--name", metavar="N", help="of the FMU, Signal_N.fmu (the file's)")
    verb.add_argument("--out", type=Path, default=DEFAULT_FOLDER, metavar="DIR", help="folder (%(default)s)")
    verb.add_argument("--time", metavar="COLUMN", help="column of the times (the first, named time)")
    verb.add_argument(
        "--interpolation", choices=_INTERPOLATIONS, default="linear", help="what is between the rows (%(default)s)"
    )
    for kind, example in (("rate", "base.z=base.vz"), ("integral", "train.vx=train.x")):
        verb.add_argument(
            f"--{kind}",
            action="append",
            default=[],
            metavar="COLUMN=NAME",
            help=f"an output more, the exact {kind} of a column, such as {example}; repeatable",
        )
    verb.add_argument("--repeat", action="store_true", help="begin again at the end of the table")
    _add_runtime(verb)
    verb.set_defaults(run=_build_signal)


def _add_runtime(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--standalone",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="bring Python, numpy and scipy along (default: as the FMU that is replaced)",
    )
    verb.add_argument("--runtime", type=Path, metavar="DIR", help="the Python to bring along (the present one)")


def _add_lookup(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("--pantographs", type=_count, metavar="P", help="pantograph ports of a line (1)")
    text = "look for lines/NAME.toml and pantographs/NAME.toml in this folder, and in its parents up to the project, "
    verb.add_argument(
        "--library",
        action="append",
        type=Path,
        metavar="DIR",
        help=f"{text}before OPENPANTO_LIBRARY and the library; repeatable (default: the working directory)",
    )
    text = "definition to take if only the library has one of the name"
    verb.add_argument("--built-from", type=Path, metavar="FILE", help=text)


def add_doctor(verbs: Any) -> None:
    """Declare ``doctor``."""
    text = "report what this machine lacks to run an FMU"
    verb = verbs.add_parser("doctor", help=text, description=text)
    verb.add_argument("fmu", type=Path, metavar="FILE", help="X.fmu")
    verb.set_defaults(run=_examine)


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 2 and 1 <= int(text) <= _MAX_PORTS):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of pantographs, 1 to {_MAX_PORTS}")
    return int(text)


def _build(options: argparse.Namespace) -> None:
    from fmus.builder.recipe import known_names

    _build_all(_recipes(options.names or known_names(), options), options)


def _build_signal(options: argparse.Namespace) -> None:
    from fmus.builder.signal_recipe import SignalRequest, end_doubt, signal_recipe

    wanted = SignalRequest(
        options.file, options.name, options.time, options.interpolation, options.rate, options.integral, options.repeat
    )
    found = signal_recipe(wanted)
    if doubt := end_doubt(wanted):
        print(f"note: {printable(doubt)}", file=sys.stderr)
    _build_all([found], options)


def _build_all(recipes: Sequence[Recipe], options: argparse.Namespace) -> None:
    from fmus.builder.fmu_build import build, why_no_loader
    from fmus.builder.recipe import BuildError

    if options.runtime is not None and options.standalone is False:
        raise BuildError("--runtime is for standalone FMUs, which --no-standalone excludes")
    for wanted in recipes:
        runtime = _runtime(options, options.out / f"{wanted.name}.fmu")
        print(build(wanted, options.out, runtime=runtime.files if runtime else None))
    if why := why_no_loader():
        print(f"note: the FMUs have pythonfmu's own library only, without our loader: {why}", file=sys.stderr)


def _runtime(options: argparse.Namespace, replaced: Path) -> Runtime | None:
    """Return the Python that an FMU is to bring along, if it is asked for or the FMU that it replaces brings one."""
    from fmus.builder.recipe import BuildError
    from fmus.builder.standalone_fmu import bundled_platform, runtime_of

    if options.standalone or options.runtime is not None:
        return _noted(runtime_of(options.runtime))
    there = bundled_platform(replaced) if options.standalone is None else ""
    if not there:
        return None
    runtime = runtime_of(None)
    if runtime.platform != there:
        raise BuildError(
            f"{replaced} brings a Python for {there}, this one is for {runtime.platform}; build it with "
            "--runtime DIR, the folder of such a Python, or with --no-standalone"
        )
    return runtime


def _noted(runtime: Runtime) -> Runtime:
    """Return a runtime, after a note if it could not be tried out."""
    if not runtime.was_tried:
        print(f"note: the Python for {runtime.platform} could not be tried out on this system", file=sys.stderr)
    return runtime


def _write_runtime(options: argparse.Namespace) -> None:
    from fmus.builder.standalone_fmu import runtime_of, write_runtime

    print(write_runtime(_noted(runtime_of(options.runtime)), options.out))


def _examine(options: argparse.Namespace) -> int:
    from fmus.loader import doctor

    return doctor.main(options.fmu)


def _recipes(names: Sequence[str], options: argparse.Namespace) -> list[Recipe]:
    from fmus.builder.recipe import BuildError, doubts, recipe

    # All names are looked up before anything is built: a typing mistake must not cost a build.
    for folder in options.library or ():
        if not folder.is_dir():
            raise BuildError(f"--library {folder}: there is no such folder; check the name")
    folders = search_path(*(options.library or ()))
    found = [recipe(name, options.pantographs, folders, options.built_from) for name in names]
    for text in dict.fromkeys(text for name in names for text in doubts(name, folders)):
        print(f"note: {printable(text)}", file=sys.stderr)
    return found


def _fingerprint(options: argparse.Namespace) -> None:
    from fmus.builder.recipe import UnknownFmuError, fingerprint
    from fmus.builder.watched_places import watched_places

    definitions = [] if options.built_from is None else [options.built_from]
    try:
        (wanted,) = _recipes([options.name], options)
    except UnknownFmuError:
        if not options.if_known:
            raise
    else:
        print(fingerprint(wanted))
        definitions.append(wanted.definition)
    if options.watched:
        starts = options.library or [Path()]
        for place in watched_places(starts, search_path(*starts), definitions):
            print(f"watched: {json.dumps(str(place))}")


def _list(options: argparse.Namespace) -> None:
    from fmus.builder.recipe import known_names

    for name in known_names():
        print(name)


if __name__ == "__main__":
    sys.exit(main())
