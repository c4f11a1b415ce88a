"""``python -m models statics LINE``: static shape, droppers, elasticity, steady arms and wave figures of a line."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from models.catenary.statics import rest_profile
from models.catenary.statics.temperature_table import check_tensioned
from models.commands import route_plots, statics_plots, temperature_report, wind_report
from models.commands.desk import statics_page
from models.commands.desk.statics_page import Found
from models.commands.physics_files import write_csv, write_figure, write_text
from models.commands.physics_options import (
    check_folder,
    new_folder,
    own_settings,
    print_table,
    shown_progress,
    warn,
)
from models.definition_files.parameter import ParameterError
from models.interface.line_in_wind import LineInWind, asked_wind, in_the_wind
from models.interface.line_over_temperature import LineOverTemperature, at_temperatures
from models.interface.line_statics import LineStatics, at_rest
from models.library.catalogue import doubts, line_path, load_line

#: Speed of the train if none is given [km/h].
_SPEED: Final = 300.0
_TRAIN: Final = "speed of the train"


def run(arguments: argparse.Namespace) -> int:
    """Analyse, print, and write if asked to."""
    check_folder(arguments.out)
    blows = arguments.wind is not None or arguments.pressure is not None
    if not blows and (arguments.limit is not None or arguments.head is not None):
        raise ParameterError("--limit and --head are limits in the wind: give --wind, in m/s, or --pressure, in Pa")
    asked = [*map(temperature_report.kelvin, arguments.temperature)]
    result = analyse(arguments)
    wind = _in_wind(result, arguments) if blows else None
    over = _over_temperature(result, asked, arguments.quiet) if asked else None
    found = Found(result, over, wind, str(line_path(arguments.line)), tuple(_asked(result, arguments)))
    show(arguments.line, found)
    if arguments.out is not None:
        write(new_folder(arguments.out), found)
        print(f"page, tables and plots: {arguments.out}")
    return 0


def show(name: str, found: Found) -> None:
    """Print figures and tables."""
    result, over, wind = found.result, found.over, found.wind
    print_table(f"{name}: {result.model.definition.title}", ("quantity", "value"), figures(found))
    print_table(f"Droppers of span {result.number}", _DROPPER_COLUMNS, _dropper_rows(result))
    if over is not None:
        _print_temperatures(over)
    if wind is not None:
        rows = [*wind_report.summary(wind), *((j.what, j.text) for j in wind.judgements)]
        print_table("In the wind", ("quantity", "value"), rows)
        print_table("Offsets of the contact wire", wind_report.COLUMNS, wind_report.rows(wind))


def analyse(arguments: argparse.Namespace) -> LineStatics:
    """Find the static state of the line and the elasticity of one span.

    Raises
    ------
    ParameterError
        If the line has no such section or span, or none of the tensioning that temperatures ask for.
    """
    definition = load_line(arguments.line)
    warn(doubts("lines", arguments.line))
    definition = definition.with_values(own_settings(arguments.set, "line", definition))
    if arguments.temperature:
        check_tensioned(definition)
    found = at_rest(definition, arguments.span, arguments.section, (arguments.speed or _SPEED) / 3.6, arguments.force)
    if arguments.speed is None and found.warnings:
        warn([f"no --speed is given, so that of the train is taken as {_SPEED:g} km/h"])
    warn(found.warnings)
    return found


def _speed_text(arguments: argparse.Namespace) -> str:
    return f"{_SPEED:g} km/h, as no --speed is given" if arguments.speed is None else f"{arguments.speed:g} km/h"


def _in_wind(result: LineStatics, arguments: argparse.Namespace) -> LineInWind:
    names = ("--wind", "--pressure")
    _, pressure = asked_wind(result.model.definition, arguments.wind, arguments.pressure, names)
    return in_the_wind(result.model, result.section, pressure, arguments.limit, arguments.head)


def _over_temperature(result: LineStatics, asked: Sequence[float], is_quiet: bool) -> LineOverTemperature:
    """Return the line at some temperatures [K]; at a terminal a bar shows how far that is."""
    with shown_progress(asked, "temperatures", is_quiet) as one_by_one:
        return at_temperatures(result.model.definition, one_by_one, result.section, result.waves.train_speed)


def _asked(result: LineStatics, arguments: argparse.Namespace) -> Iterator[tuple[str, str]]:
    """Yield what was asked for: what, value with unit."""
    sections = len(result.model.definition.sections)
    if sections > 1:
        yield "section", f"{result.section + 1} of {sections}"
    yield _TRAIN, _speed_text(arguments)
    yield "force of the elasticity", f"{arguments.force:g} N"
    if arguments.temperature:
        yield "temperatures", ", ".join(f"{t:g}" for t in arguments.temperature) + " \u00b0C"
    if arguments.wind is not None:
        yield "wind", f"{arguments.wind:g} m/s from either side"
    if arguments.pressure is not None:
        yield "wind", f"{arguments.pressure:g} Pa from either side"
    if arguments.limit is not None:
        yield "permissible offset from the middle of the track", f"{arguments.limit:g} m"
    if arguments.head is not None:
        yield "pantograph head", f"{arguments.head} mm"
    for given in arguments.set:
        if given.part == "line":
            yield "changed", f"{given.parameter} = {given.value}"


def _print_temperatures(over: LineOverTemperature) -> None:
    wanted, span = over.ruling
    print_table(
        f"Temperatures; sag in the span {span.start:g} ... {span.end:g} m, the ruling span is {wanted:.2f} m",
        temperature_report.COLUMNS,
        temperature_report.rows(over.states),
    )
    rows = [*((j.what, j.text) for j in over.judgements), *temperature_report.swings(over.states)]
    print_table("Movements and waves", ("quantity", "value"), rows)


def figures(found: Found) -> list[tuple[str, str]]:
    """Return the speed that all is judged at, and the `summary` of the line."""
    return [*(pair for pair in found.asked if pair[0] == _TRAIN), *summary(found.result)]


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


def write(folder: Path, found: Found) -> None:
    """Write the page, tables as CSV and plots as PNG, the strip chart of the line as SVG too."""
    result = found.result
    for name, (titles, columns) in result.tables.items():
        write_csv(folder / f"{name}.csv", titles, [column.astype(float) for column in columns])
    lines = [f"{_quoted(name)},{_quoted(value)}" for name, value in figures(found)]
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
    if found.wind is not None:
        wind_report.write(folder, found.wind)
    if found.over is not None:
        temperature_report.write(folder, found.over)
    write_text(folder / "statics.html", statics_page.page(found))


def _quoted(text: str) -> str:
    """Return a text as CSV has it."""
    return '"' + text.replace('"', '""') + '"'


_DROPPER_COLUMNS = ("x [m]", "from the support [m]", "unstrained length [m]", "tension [N]")


def _profile_rows(result: LineStatics) -> list[tuple[str, str]]:
    contact = next(p for p in result.profiles if p.component == "contact_wire")
    z = contact.z[rest_profile.within(contact, result.span)]
    rows = [("contact wire, highest and lowest [m]", f"{z.max():.4f}, {z.min():.4f}")]
    place, offset = rest_profile.largest_offset(contact, result.supports.x)
    side = "left" if offset > 0.0 else "right"
    rows.append(("largest offset of the contact wire [mm]", f"{1e3 * abs(offset):.0f} {side} at {place:.0f} m"))
    d = result.span_droppers
    if not len(d.length):
        return rows
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
        (
            f"steady arm at {result.span.start:g} m, lift by its tension [N]",
            f"{round(result.arms.lift[arm], 1) + 0.0:.1f}",
        ),
        (f"steady arm at {result.span.start:g} m, stiffness N/l [N/m]", f"{result.arms.pendulum[arm]:.1f}"),
    ]


def _dropper_rows(result: LineStatics) -> Iterable[Sequence[str]]:
    d = result.span_droppers
    for x, length, force, hanger in zip(d.x, d.length, d.force, d.is_hanger, strict=True):
        place = f"{x:.2f}{' (hanger)' if hanger else ''}", f"{x - result.span.start:.2f}"
        yield *place, f"{length:.4f}", f"{force:.1f}"
