"""``python -m models statics LINE``: static shape, droppers, elasticity, steady arms and wave figures of a line."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from models.catenary.statics import rest_profile
from models.catenary.statics.temperature_table import LineAtTemperature, ruling, temperature_table
from models.commands import route_plots, statics_plots, temperature_report, wind_report
from models.commands.physics_files import write_csv, write_figure, write_text
from models.commands.physics_options import (
    check_folder,
    new_folder,
    print_table,
    settings,
    warn,
)
from models.definition_files.parameter import ParameterError
from models.interface.line_statics import LineStatics, at_rest
from models.library.catalogue import doubts, load_line


def run(arguments: argparse.Namespace) -> int:
    """Analyse, print, and write if asked to."""
    check_folder(arguments.out)
    result = analyse(arguments)
    blows = arguments.wind is not None or arguments.pressure is not None
    if not blows and (arguments.limit is not None or arguments.head is not None):
        raise ParameterError("--limit and --head are limits in the wind: give --wind, in m/s, or --pressure, in Pa")
    wind = wind_report.in_the_wind(result, arguments) if blows else None
    asked = [*map(temperature_report.kelvin, arguments.temperature)]
    states = temperature_table(result.model.definition, asked, result.section) if asked else ()
    print_table(f"{arguments.line}: {result.model.definition.title}", ("quantity", "value"), summary(result))
    print_table(f"Droppers of span {result.number}", _DROPPER_COLUMNS, _dropper_rows(result))
    if states:
        _print_temperatures(result, states)
    if wind is not None:
        print_table("In the wind", ("quantity", "value"), wind_report.summary(wind))
        print_table("Offsets of the contact wire", wind_report.COLUMNS, wind_report.rows(wind))
    if arguments.out is not None:
        folder = new_folder(arguments.out)
        write(folder, result)
        if wind is not None:
            wind_report.write(folder, wind)
        if states:
            temperature_report.write(folder, states)
        print(f"tables and plots: {folder}")
    return 0


def analyse(arguments: argparse.Namespace) -> LineStatics:
    """Find the static state of the line and the elasticity of one span.

    Raises
    ------
    ParameterError
        If the line has no such section or span.
    """
    definition = load_line(arguments.line)
    warn(doubts("lines", arguments.line))
    definition = definition.with_values(settings(arguments.set, "line", definition))
    found = at_rest(definition, arguments.span, arguments.section, arguments.speed / 3.6, arguments.force)
    warn(found.warnings)
    return found


def _print_temperatures(result: LineStatics, states: Sequence[LineAtTemperature]) -> None:
    wanted, span = ruling(result.model.definition.sections[result.section])
    print_table(
        f"Temperatures; sag in the span {span.start:g} ... {span.end:g} m, the ruling span is {wanted:.2f} m",
        temperature_report.COLUMNS,
        temperature_report.rows(states),
    )
    print_table("Movements", ("quantity", "value"), temperature_report.swings(states))


def summary(result: LineStatics) -> list[tuple[str, str]]:
    """Return the figures of a line as rows: what, value with unit."""
    e, w, span = result.elasticity, result.waves, result.span
    return [
        ("span in detail", f"{result.number}: {span.start:g} ... {span.end:g} m"),
        *_profile_rows(result),
        (f"elasticity at {e.force:g} N, minimum [mm/N]", f"{1e3 * e.minimum:.4f}"),
        (f"elasticity at {e.force:g} N, maximum [mm/N]", f"{1e3 * e.maximum:.4f}"),
        ("non-uniformity of elasticity u [%]", f"{100.0 * e.non_uniformity:.1f}"),
        *_other_rows(result),
        *_arm_rows(result),
        *result.verdicts,
        ("law by which droppers slacken", result.model.definition.dropper.slack_law),
        ("wave speed C [km/h]", f"{3.6 * w.speed:.1f}"),
        ("limit of operation 0.7 C [km/h]", f"{3.6 * w.limit:.1f}"),
        ("reflection factor r", f"{w.reflection:.4f}"),
        (f"Doppler factor at {3.6 * w.train_speed:g} km/h", f"{w.doppler:.4f}"),
        (f"amplification coefficient at {3.6 * w.train_speed:g} km/h", f"{w.amplification:.3f}"),
    ]


def write(folder: Path, result: LineStatics) -> None:
    """Write tables as CSV and plots as PNG, the strip chart of the line as SVG too."""
    for name, (titles, columns) in result.tables.items():
        write_csv(folder / f"{name}.csv", titles, [column.astype(float) for column in columns])
    lines = [f'"{name}","{value}"' for name, value in summary(result)]
    write_text(folder / "summary.csv", "\n".join(["quantity,value", *lines]) + "\n")
    plots = {
        "span": statics_plots.span_profile(result.profiles, result.droppers, result.span),
        "elasticity": statics_plots.elasticity(result.elasticity, result.span),
        "droppers": statics_plots.droppers(result.span_droppers, result.span),
    }
    for name, figure in plots.items():
        write_figure(folder / f"{name}.png", figure, 150)
    for ending in ("png", "svg"):
        write_figure(folder / f"profile.{ending}", route_plots.profile(result), 150)


_DROPPER_COLUMNS = ("x [m]", "from the support [m]", "unstrained length [m]", "tension [N]")


def _profile_rows(result: LineStatics) -> list[tuple[str, str]]:
    contact = next(p for p in result.profiles if p.component == "contact_wire")
    z = contact.z[rest_profile.within(contact, result.span)]
    rows = [("contact wire, highest and lowest [m]", f"{z.max():.4f}, {z.min():.4f}")]
    d = result.span_droppers
    rows.append(("dropper lengths, longest and shortest [m]", f"{d.length.max():.4f}, {d.length.min():.4f}"))
    rows.append(("dropper tensions, largest and smallest [N]", f"{d.force.max():.1f}, {d.force.min():.1f}"))
    return rows


def _other_rows(result: LineStatics) -> list[tuple[str, str]]:
    """Return the elasticity of the other sections of a line with overlaps, each in its middle span."""
    return [
        (
            f"section {section + 1}, span {number}: elasticity [mm/N], u [%]",
            f"{1e3 * e.minimum:.4f} ... {1e3 * e.maximum:.4f}, {100.0 * e.non_uniformity:.1f}",
        )
        for section, (number, e) in result.others.items()
    ]


def _arm_rows(result: LineStatics) -> list[tuple[str, str]]:
    at = np.flatnonzero(np.abs(result.arms.x - result.span.start) < 0.1)
    if not at.size:
        return []
    arm = int(at[0])
    return [
        (f"steady arm at {result.span.start:g} m, lateral load [N]", f"{result.arms.lateral[arm]:.1f}"),
        (f"steady arm at {result.span.start:g} m, lift by its tension [N]", f"{result.arms.lift[arm]:.1f}"),
        (f"steady arm at {result.span.start:g} m, stiffness N/l [N/m]", f"{result.arms.pendulum[arm]:.1f}"),
    ]


def _dropper_rows(result: LineStatics) -> Iterable[Sequence[str]]:
    d = result.span_droppers
    for x, length, force, hanger in zip(d.x, d.length, d.force, d.is_hanger, strict=True):
        place = f"{x:.2f}{' (hanger)' if hanger else ''}", f"{x - result.span.start:.2f}"
        yield *place, f"{length:.4f}", f"{force:.1f}"
