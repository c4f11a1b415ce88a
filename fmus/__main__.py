"""Command line: ``python -m fmus build | doctor | fingerprint | list``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from fmus import doctor
from fmus.build import (
    MAX_PORTS,
    BuildError,
    Recipe,
    UnknownFmuError,
    build,
    fingerprint,
    known_names,
    recipe,
    why_no_loader,
)

DEFAULT_FOLDER = Path("build/fmus")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; 0 for success, 1 for a failure, 2 for a wrong command line."""
    options = _parser().parse_args(arguments)
    try:
        code: int | None = options.run(options)
    except UnknownFmuError as error:
        return _fail(str(error), 2)
    except BuildError as error:
        return _fail(str(error), 1)
    except OSError as error:
        return _fail(f"{error.filename or 'a file'}: {error.strerror or error}", 1)
    except KeyboardInterrupt:
        return _fail("interrupted", 1)
    return code or 0


def _fail(text: str, code: int) -> int:
    print(f"error: {text}", file=sys.stderr)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m fmus", description="Build FMUs, and see whether they run here.")
    verbs = parser.add_subparsers(required=True, metavar="COMMAND")
    verb = verbs.add_parser("build", help="build FMUs, all of the library if none is named")
    verb.add_argument("names", nargs="*", metavar="NAME", help="Catenary_LN2, Pantograph_CX, path/to/LINE.toml ...")
    verb.add_argument("--out", type=Path, default=DEFAULT_FOLDER, metavar="DIR", help="folder (%(default)s)")
    verb.add_argument("--pantographs", type=_count, metavar="P", help="pantograph ports of the lines (1)")
    verb.set_defaults(run=_build)
    verb = verbs.add_parser("doctor", help="say what this machine lacks for running an FMU")
    verb.add_argument("fmu", type=Path, metavar="FILE", help="X.fmu")
    verb.set_defaults(run=_examine)
    verb = verbs.add_parser("fingerprint", help="print the content hash (GUID) that a build would have now")
    verb.add_argument("--pantographs", type=_count, metavar="P", help="pantograph ports of a line (1)")
    verb.add_argument("name", metavar="NAME", help="as for build")
    verb.set_defaults(run=_fingerprint)
    verb = verbs.add_parser("list", help="list the FMUs that can be built")
    verb.set_defaults(run=_list)
    return parser


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 2 and 1 <= int(text) <= MAX_PORTS):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of pantographs, 1 to {MAX_PORTS}")
    return int(text)


def _build(options: argparse.Namespace) -> None:
    for wanted in _recipes(options.names or known_names(), options.pantographs):
        print(build(wanted, options.out))
    if why := why_no_loader():
        print(f"note: the FMUs have pythonfmu's own library only, without our loader: {why}", file=sys.stderr)


def _examine(options: argparse.Namespace) -> int:
    return doctor.main(options.fmu)


def _recipes(names: Sequence[str], pantographs: int | None) -> list[Recipe]:
    # All names are looked up before anything is built: a typing error must not cost a build.
    return [recipe(name, pantographs) for name in names]


def _fingerprint(options: argparse.Namespace) -> None:
    print(fingerprint(recipe(options.name, options.pantographs)))


def _list(options: argparse.Namespace) -> None:
    for name in known_names():
        print(name)


if __name__ == "__main__":
    sys.exit(main())
