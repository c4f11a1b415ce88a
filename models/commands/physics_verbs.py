"""The verbs and their options: declared here, carried out by one file each, which is imported when that is to be done.

This one imports nothing that takes time, so that help, completion and a mistyped option are answered at once. What can
be chosen is written out, and tests compare it with the kinds that there are.
"""

from __future__ import annotations

import argparse
import importlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

from models.definition_files.given_value import number_advice
from models.definition_files.toml_reader import LARGEST, SMALLEST

#: What can be chosen, the default first; tests/test_registries.py.
RESPONSES: Final = ("receptance", "apparent_mass", "dynamic_stiffness")
FILTERS: Final = ("butterworth", "fft")
#: What has parameters on the command line.
PARTS: Final = ("line", "pantograph")


def add_statics(verbs: Any) -> None:
    """Declare ``statics``."""
    parser = verbs.add_parser("statics", help="static shape, droppers, elasticity and wave figures of a line")
    parser.add_argument("line", help="name in the library, or a definition file")
    parser.add_argument("--span", type=int, default=None, help="span in detail, from 1 (default: the middle one)")
    parser.add_argument("--section", type=int, default=1, help="section of a line with overlaps, from 1 (default 1)")
    parser.add_argument("--speed", type=positive, help="speed of the train, km/h (300 if it is not given)")
    parser.add_argument("--force", type=positive, default=100.0, help="force of the elasticity [N] (default 100)")
    parser.add_argument(
        "--temperature", type=finite, nargs="+", default=[], metavar="T",
        help="temperatures [degC] for a table of tensions, movements and sags, of a line with a table [tensioning]",
    )  # fmt: skip
    add_wind(parser)
    text = "folder for the page (statics.html), tables (CSV) and plots (PNG)"
    parser.add_argument("--out", type=Path, default=None, help=text)
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_settings(parser)
    parser.set_defaults(run=_later("statics_command"))


def add_spans(verbs: Any) -> None:
    """Declare ``spans``."""
    parser = verbs.add_parser("spans", help="smallest radius for a span, largest span for a radius, in the wind")
    parser.add_argument("line", help="name in the library, or a definition file")
    add_wind(parser)
    parser.add_argument(
        "--radius", type=positive, nargs="+", default=None, metavar="R", help="radii for the largest span [m]"
    )
    parser.add_argument(
        "--stagger", type=finite, nargs=2, action="append", default=[], metavar=("B1", "B2"),
        help="staggers at both ends of a span, positive to the outside of the curve [m]; may be given several times "
        "(default: the line's, alternating and not)",
    )  # fmt: skip
    text = "folder for the page (spans.html), tables (CSV) and the plot (PNG)"
    parser.add_argument("--out", type=Path, default=None, help=text)
    add_settings(parser)
    parser.set_defaults(run=_later("spans_command"))


def add_asbuilt(verbs: Any) -> None:
    """Declare ``asbuilt``."""
    parser = verbs.add_parser("asbuilt", help="a line as it hangs, from a measuring run, and which droppers to correct")
    parser.add_argument("line", metavar="design", help="the line as designed: name in the library, or definition file")
    parser.add_argument(
        "measured", type=Path, help="CSV or XLSX file: position, height, and stagger, thickness, structure if measured"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for definitions, page, tables and figures")
    parser.add_argument(
        "--tolerance", type=positive, default=10.0, metavar="MM", help="of dropper lengths [mm] (default 10)"
    )
    parser.add_argument(
        "--step", type=positive, default=5.0, metavar="MM", help="changes are multiples of it [mm] (default 5)"
    )
    text = "change the N most useful droppers alone"
    parser.add_argument("--only", type=_number_of, default=None, metavar="N", help=text)
    parser.add_argument("--quiet", action="store_true", help="no progress")
    parser.set_defaults(run=_later("asbuilt_command"))


def _number_of(text: str) -> int:
    """Read a whole number greater than 0 from the command line."""
    if not (text.isascii() and text.isdigit() and 0 < int(text) <= 10**6):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number, 1 or more")
    return int(text)


def add_wind(parser: argparse.ArgumentParser) -> None:
    """Declare what wind is meant, and how far the wire may be blown by it."""
    strength = parser.add_mutually_exclusive_group()
    strength.add_argument(
        "--wind", type=positive, default=None, metavar="V",
        help="speed of a steady wind across the line [m/s], in place of that of [wind.design]",
    )  # fmt: skip
    strength.add_argument(
        "--pressure", type=positive, default=None, metavar="PA", help="or its pressure, 1/2 rho V^2 G_q [Pa]"
    )
    allowed = parser.add_mutually_exclusive_group()
    allowed.add_argument(
        "--limit",
        type=positive,
        default=None,
        metavar="M",
        help="how far the wire may be from the middle of the track [m]",
    )
    allowed.add_argument(
        "--head", choices=("1600", "1950"), default=None, help="or by the pantograph head [mm], EN 50367 and EN 15273"
    )


def add_pantograph(verbs: Any) -> None:
    """Declare ``pantograph``."""
    parser = verbs.add_parser("pantograph", help="statics over height, modes, apparent mass of a pantograph")
    parser.add_argument("pantograph", help="name in the library, or a definition file")
    parser.add_argument("--force", type=finite, default=157.5, help="contact force of the working point [N]")
    parser.add_argument(
        "--heights", type=finite, nargs=2, default=None, metavar=("FROM", "TO"), help="strip heights above rail [m]"
    )
    parser.add_argument("--height", type=finite, default=None, help="strip height of the working point [m]")
    parser.add_argument(
        "--limit",
        type=positive,
        default=None,
        metavar="N",
        help="judge half the difference of the force up and down [N]",
    )
    parser.add_argument("--out", type=Path, default=None, help="folder for tables (CSV) and plots (PNG)")
    add_settings(parser)
    parser.set_defaults(run=_later("pantograph_command"))


def add_identify(verbs: Any) -> None:
    """Declare ``identify``."""
    parser = verbs.add_parser("identify", help="fit a lumped pantograph to a frequency response")
    parser.add_argument("response", type=Path, help="CSV file: frequency [Hz], real part, imaginary part")
    parser.add_argument("--kind", choices=RESPONSES, default="receptance", help="what the two parts are of")
    parser.add_argument("--stages", type=int, default=3, help="number of masses (default 3)")
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        type=_fixed,
        metavar="NAME=VALUE",
        help="known value: m3=7.75 (m, c, k; 1 is lowest)",
    )
    parser.add_argument(
        "--following", action="store_true", help="the lowest spring follows the height: find its time constant T, too"
    )
    parser.add_argument("--plot", type=Path, default=None, help="PNG file for measured and fitted response")
    parser.set_defaults(run=_later("identify_command"))


def _fixed(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"'{text}': write NAME=VALUE")
    try:
        return name, float(value)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}': '{value}' is not a number") from error


def add_couple(verbs: Any) -> None:
    """Declare ``couple``."""
    parser = verbs.add_parser("couple", help="run a lumped pantograph on a line as one system, without co-simulation")
    parser.add_argument("line", help="name in the library, or a definition file")
    parser.add_argument("pantograph", help="name in the library, or a definition file")
    parser.add_argument("--speed", type=positive, default=300.0, help="km/h (default 300)")
    parser.add_argument("--start", type=finite, default=None, help="where the pantograph is raised [m]")
    parser.add_argument("--end", type=finite, default=None, help="where the run ends [m]")
    text = "interval of interest [m] (default: from 1 s after the first contact to the end)"
    parser.add_argument("--interval", type=finite, nargs=2, metavar=("FROM", "TO"), help=text)
    parser.add_argument("--step", type=positive, default=1e-3, help="time step [s] (default 0.001)")
    parser.add_argument("--out", type=Path, default=None, help="folder for timeseries.csv")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_filter(parser)
    add_settings(parser)
    parser.set_defaults(run=_later("couple_command"))


def add_import(verbs: Any) -> None:
    """Declare ``import``."""
    parser = verbs.add_parser("import", help="make the definition of a line from its layout, tables as CSV or XLSX")
    text = "folder of CSV files (supports, droppers, wires), or a workbook with these sheets (.xlsx)"
    parser.add_argument("layout", type=Path, metavar="LAYOUT", help=text)
    parser.add_argument("--design", metavar="LINE", help="line, by name or file, that gives what the layout does not")
    text = "definition file to write; the line has its name"
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.toml", help=text)
    parser.set_defaults(run=_later("import_command"))


def add_export(verbs: Any) -> None:
    """Declare ``export``."""
    parser = verbs.add_parser("export", help="write the layout of a line, with the lengths of its droppers")
    parser.add_argument("line", metavar="LINE", help="name in the library, or a definition file")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the tables (CSV)")
    text = "write the tables as one workbook, LINE.xlsx (needs openpyxl: pip install 'openpanto[xlsx]')"
    parser.add_argument("--xlsx", action="store_true", help=text)
    text = "draw profile.dxf and plan.dxf as well (needs ezdxf: pip install 'openpanto[dxf]')"
    parser.add_argument("--dxf", action="store_true", help=text)
    parser.set_defaults(run=_later("export_command"))


def add_lanes(verbs: Any) -> None:
    """Declare ``lanes``."""
    parser = verbs.add_parser("lanes", help="make many runs of one line side by side (a sweep's engine)")
    parser.add_argument("job", type=Path, help="JSON file that openpanto sweep --engine lanes writes")
    text = "folder for line.arrays and a lane_N.arrays for every run that has ended"
    parser.add_argument("--out", type=Path, required=True, help=text)
    parser.set_defaults(run=_later("lanes_command"))


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add ``--set part.parameter=value``, repeatable."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=_setting,
        metavar="PART.PARAMETER=VALUE",
        help="change a parameter: line.damping.alpha=0.00275, line.contact_wire.tension='12 kN' (SI where no unit is)",
    )


def add_filter(parser: argparse.ArgumentParser) -> None:
    """Add the choice of the contact force's low-pass."""
    parser.add_argument("--filter", choices=FILTERS, default=FILTERS[0], help="low-pass of the force")
    parser.add_argument("--filter-order", type=int, metavar="N", help="of butterworth (default 6)")
    parser.add_argument("--filter-phase", choices=("zero", "causal"), help="of butterworth (default zero)")
    parser.add_argument("--cutoff", type=positive, default=20.0, help="Hz (default 20)")


class Setting(NamedTuple):
    """A value from the command line: of the line or the pantograph, its parameter, and as text with or without unit."""

    part: str
    parameter: str
    value: str


def _setting(text: str) -> Setting:
    name, equals, value = text.partition("=")
    part, dot, parameter = name.partition(".")
    if not (equals and dot and parameter and value) or part not in PARTS:
        raise argparse.ArgumentTypeError(f"'{text}': write line.PARAMETER=VALUE or pantograph.PARAMETER=VALUE")
    return Setting(part, parameter, value)


def finite(text: str) -> float:
    """Read a finite number from the command line; argparse reports what is wrong with another."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST or "_" in text or not text.isascii():
        raise argparse.ArgumentTypeError(f"'{text}' is not a number (finite, at most {LARGEST:g}){number_advice(text)}")
    return value


def positive(text: str) -> float:
    """Read a number greater than 0 from the command line."""
    value = finite(text)
    if value < SMALLEST:
        raise argparse.ArgumentTypeError(f"'{text}' must be greater than 0")
    return value


def _later(module: str) -> Callable[[argparse.Namespace], int]:
    """Return what carries out a verb; its module is imported when that is called."""

    def run(arguments: argparse.Namespace) -> int:
        return int(importlib.import_module(f"models.commands.{module}").run(arguments))

    return run
