"""``python -m models pantograph NAME``: statics over the working height, modes, apparent mass of a pantograph."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from models.arrays import FloatArray
from models.commands.cam_curves import write_cam
from models.commands.force_over_speed import SPEEDS, print_over_speed, tabulated, write_over_speed
from models.commands.physics_files import set_heading, show_no_noise, write_csv, write_figure
from models.commands.physics_options import check_folder, new_folder, own_settings, print_table, warn
from models.definition_files.parameter import ParameterError
from models.interface.norm_judgement import verdict_word
from models.library.catalogue import doubts, load_pantograph, pantograph_path
from models.pantograph.lumped import lumped_rig as lumped
from models.pantograph.lumped.lumped_advice import idle_values
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.multibody.analysis.mechanism_rig import CamCurves, Dynamics, Rig
from models.pantograph.multibody.mechanism import MechanismError
from models.pantograph.multibody.mechanism_advice import inertia_warning
from models.pantograph.multibody.mechanism_definition import JointFriction, MechanismDefinition
from models.pantograph.multibody.reduced.reduced_motion import reduced_if_possible

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Significant digits of the tables: all that a double has.
_DIGITS: Final = 17
#: Speed at which the strip goes up and down against its wire [m/s].
_SLOW: Final = 0.05
#: Columns of what comes of that.
LOOP: Final = ("strip height [m]", "force up [N]", "force down [N]", "mean [N]", "half difference [N]")


@dataclass(frozen=True)
class Characteristics:
    """What the command reports on a pantograph.

    Attributes
    ----------
    title : str
    static_columns : tuple of str
        Names with units, strip height first.
    statics : ndarray, shape (h, len(static_columns))
    modes : tuple of (frequency [Hz], damping ratio, motion, remark)
    form : str
        In which form the equations of motion are solved; empty of a lumped model.
    freedom : int
        Independent motions that the joints allow; 0 of a lumped model, whose masses say it.
    frequency : ndarray, shape (f,)
    apparent_mass : ndarray of complex, shape (f,)
        [kg]
    up_and_down : ndarray, shape (h, 5)
        See `LOOP`.
    over_speed : ndarray, shape (s, 5)
        See `force_over_speed.tabulated`.
    alternative : (str, ndarray of complex, shape (f,)) or None
        What the apparent mass would be otherwise [kg], and when.
    cam : CamCurves or None
        Worked out if it is written.
    """

    title: str
    static_columns: tuple[str, ...]
    statics: FloatArray
    modes: tuple[tuple[float, float, str, str], ...]
    frequency: FloatArray
    apparent_mass: npt.NDArray[np.complex128]
    up_and_down: FloatArray
    over_speed: FloatArray
    freedom: int = 0
    alternative: tuple[str, npt.NDArray[np.complex128]] | None = None
    cam: CamCurves | None = None
    form: str = ""


def run(arguments: argparse.Namespace) -> int:
    """Analyse, print, and write if asked to."""
    check_folder(arguments.out)
    definition = load_pantograph(arguments.pantograph)
    warn(doubts("pantographs", arguments.pantograph))
    definition = definition.with_values(own_settings(arguments.set, "pantograph", definition))
    try:
        result = (
            _multibody(definition, arguments)
            if isinstance(definition, MechanismDefinition)
            else _lumped(definition, arguments)
        )
    except MechanismError as error:
        text = str(error).removeprefix(f"{definition.name}: ")
        raise MechanismError(f"{pantograph_path(arguments.pantograph)}: {text}") from error
    print_table(
        f"{arguments.pantograph}: {result.title}",
        result.static_columns,
        ([f"{v:.3f}" if i == 0 else f"{round(v, 2) + 0.0:.2f}" for i, v in enumerate(row)] for row in result.statics),
    )
    _print_loop(result.up_and_down, arguments.limit)
    print_over_speed(result.over_speed)
    if result.form:
        print(f"\n{result.form}")
    freedom = f", {result.freedom} degrees of freedom" if result.freedom else ""
    print_table(
        f"Modes, strip free{freedom}", ("frequency [Hz]", "damping [%]", "motion", "remark"), _mode_rows(result)
    )
    response_columns = ("frequency [Hz]", "magnitude [kg]", "phase [deg]")
    print_table("Apparent mass of the strip", response_columns, _response_rows(result))
    if arguments.out is not None:
        folder = new_folder(arguments.out)
        write(folder, result)
        print(f"tables and plots: {folder}")
    return 0


def _print_loop(loop: FloatArray, limit: float | None) -> None:
    if not len(loop):
        return
    rows = ([f"{row[0]:.3f}", *(f"{round(v, 2) + 0.0:.2f}" for v in row[1:])] for row in loop)
    print_table(f"Static force with the strip moved up and down at {_SLOW:g} m/s", LOOP, rows)
    if limit is not None:
        worst = int(np.argmax(loop[:, 4]))
        verdict = verdict_word(is_kept=loop[worst, 4] <= limit)
        found = f"{loop[worst, 4]:.2f} N at {loop[worst, 0]:.3f} m"
        print(f"largest half difference {found}: {verdict}, limit {limit:g} N")


def write(folder: Path, result: Characteristics) -> None:
    """Write statics and response as CSV and the plots as PNG."""
    write_csv(folder / "statics.csv", result.static_columns, list(result.statics.T), _DIGITS)
    response = (result.frequency, result.apparent_mass.real, result.apparent_mass.imag)
    names = ("frequency [Hz]", "apparent mass real [kg]", "apparent mass imaginary [kg]")
    write_csv(folder / "apparent_mass.csv", names, response, _DIGITS)
    write_figure(folder / "apparent_mass.png", _plot_response(result), 120)
    write_figure(folder / "statics.png", _plot_statics(result), 120)
    write_over_speed(folder, result.title, result.over_speed, _DIGITS)
    if result.cam is not None:
        write_cam(folder, result.title, result.cam, _DIGITS)
    if len(result.up_and_down):
        write_csv(folder / "static_force_up_down.csv", LOOP, list(result.up_and_down.T), _DIGITS)
        write_figure(folder / "static_force_up_down.png", _plot_loop(result), 120)


def _heights(arguments: argparse.Namespace, reference: float) -> FloatArray:
    low, high = arguments.heights or (reference - 0.5, reference + 0.5)
    if not 0.0 < low < high:
        raise ParameterError(f"--heights {low:g} {high:g}: give the lower one first, both above 0")
    return np.linspace(low, high, 11)


def _frequencies() -> FloatArray:
    return np.linspace(0.1, 20.0, 400)


def _lumped(definition: LumpedDefinition, arguments: argparse.Namespace) -> Characteristics:
    heights = _heights(arguments, definition.reference_height)
    frequency = _frequencies()
    warn([idle_values(definition)])
    if definition.follow_height:
        limit = lumped.alike_from(definition)
        text = "the apparent mass has the modulus of the spring on the roof within 2 %"
        print(f"follow_height = 1: from {limit:.2f} Hz on {text}")
    return Characteristics(
        definition.title,
        ("strip height [m]", "contact force [N]"),
        np.column_stack([heights, lumped.contact_force_over_height(definition, heights)]),
        tuple((m.frequency, m.damping, "", "") for m in lumped.modes(definition)),
        frequency,
        lumped.apparent_mass(definition, frequency),
        _loop(lumped.up_and_down(definition, heights, _SLOW)),
        tabulated(*lumped.contact_force_over_speed(definition, SPEEDS / 3.6).T),
        alternative=_on_the_roof(definition, frequency),
    )


def _multibody(definition: MechanismDefinition, arguments: argparse.Namespace) -> Characteristics:
    rig = Rig(definition)
    reference = definition.reference_height
    heights = _heights(arguments, reference)
    statics = rig.statics(heights, arguments.force)
    height = arguments.height if arguments.height is not None else reference
    dynamics = rig.dynamics(height, _frequencies(), arguments.force)
    warn([inertia_warning(definition), rig.warning(arguments.force)])
    warn([friction_warning(definition, dynamics, lambda d: Rig(d).dynamics(height, _frequencies(), arguments.force))])
    unit = rig.lift_unit
    columns = (
        "strip height [m]",
        f"lift for the weights [{unit}]",
        f"lift for {arguments.force:g} N [{unit}]",
        "contact force [N]",
    )
    return Characteristics(
        definition.title,
        columns,
        np.column_stack([statics.height, statics.balance, statics.lift, statics.contact_force]),
        tuple((m.frequency, m.damping, m.name, m.remark) for m in dynamics.motions if m.eigenvalue.imag >= 0.0),
        dynamics.frequency,
        dynamics.apparent_mass,
        _loop(rig.up_and_down(heights, _SLOW)),
        tabulated(*rig.over_speed(SPEEDS / 3.6).T),
        rig.freedom,
        cam=None if arguments.out is None else rig.cam_curves(),
        form=reduced_if_possible(rig.mechanism, rig.reference)[1],
    )


def _on_the_roof(definition: LumpedDefinition, frequency: FloatArray) -> tuple[str, npt.NDArray[np.complex128]] | None:
    """Return the apparent mass with the lowest spring on the roof, None where it is there anyway."""
    if not definition.follow_height:
        return None
    fixed = definition.with_values({"follow_height": 0})
    return "follow_height = 0", lumped.apparent_mass(fixed, frequency)


def _loop(moved: FloatArray) -> FloatArray:
    """Add mean and half difference to heights and forces up and down."""
    up, down = moved[:, 1], moved[:, 2]
    return np.column_stack([moved, 0.5 * (up + down), 0.5 * (down - up)])


def friction_warning(
    definition: MechanismDefinition, found: Dynamics, analysed: Callable[[MechanismDefinition], Dynamics]
) -> str:
    """Return what dry friction does to the modes, empty if there is none.

    About rest its force changes with the speed as a damper's of friction over transition speed does: a strong one,
    under which a mode creeps back instead of oscillating.

    Parameters
    ----------
    definition : MechanismDefinition
    found : Dynamics
        With the friction.
    analysed : callable
        Gives the dynamics of the definition without it.
    """
    rubbing = [f for f in definition.forces if isinstance(f, JointFriction) and f.level > 0.0]
    if not rubbing:
        return ""
    names = {f"force.{f.name}.{key}" for f in rubbing for key in ("force", "moment")}
    without = {p.name: 0.0 for p in definition.parameters() if p.name in names}
    free = _frequencies_of(analysed(definition.with_values(without)))
    return (
        f"dry friction in {', '.join(f.name for f in rubbing)}: the modes are those of small motions about rest, where "
        f"it damps like a fluid; {len(_frequencies_of(found))} of them oscillate, and without the friction {len(free)} "
        f"({', '.join(f'{f:.3f}' for f in free)} Hz)"
    )


def _frequencies_of(dynamics: Dynamics) -> list[float]:
    return [m.frequency for m in dynamics.modes if m.frequency > 0.0]


def _mode_rows(result: Characteristics) -> list[tuple[str, str, str, str]]:
    return [
        ("-", "-", motion, remark)
        if remark.startswith("neutral")
        else (f"{f:.3f}" if f > 0.0 else "-", f"{100.0 * d:.2f}", motion, remark)
        for f, d, motion, remark in result.modes
    ]


def _response_rows(result: Characteristics) -> list[tuple[str, str, str]]:
    rows = []
    for wanted in (0.5, 1.0, 2.0, 5.0, 7.5, 10.0, 15.0, 20.0):
        i = int(np.argmin(np.abs(result.frequency - wanted)))
        value = result.apparent_mass[i]
        rows.append((f"{result.frequency[i]:.2f}", f"{abs(value):.3f}", f"{np.degrees(np.angle(value)):.1f}"))
    return rows


def _plot_response(result: Characteristics) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.semilogy(result.frequency, np.abs(result.apparent_mass))
    upper.set_ylabel("apparent mass [kg]")
    lower.plot(result.frequency, np.degrees(np.angle(result.apparent_mass)))
    if result.alternative is not None:
        label, other = result.alternative
        upper.semilogy(result.frequency, np.abs(other), "--", label=label)
        lower.plot(result.frequency, np.degrees(np.angle(other)), "--")
        upper.legend()
    lower.set_ylabel("phase [deg]")
    lower.set_xlabel("frequency [Hz]")
    for axes in (upper, lower):
        axes.grid(visible=True, alpha=0.4)
    set_heading(figure, result.title)
    return figure


def _plot_loop(result: Characteristics) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots()
    height, up, down, mean, _ = result.up_and_down.T
    for values, label in ((up, "strip goes up"), (down, "strip goes down"), (mean, "mean")):
        axes.plot(height, values, label=label, linestyle="--" if label == "mean" else "-")
    axes.set_xlabel("strip height [m]")
    axes.set_ylabel("contact force [N]")
    axes.grid(visible=True, alpha=0.4)
    figure.legend(loc="outside lower center", ncols=3)
    set_heading(figure, f"{result.title}: static force at {_SLOW:g} m/s")
    return figure


def _plot_statics(result: Characteristics) -> Figure:
    from matplotlib.figure import Figure

    count = len(result.static_columns) - 1
    figure = Figure(figsize=(8, 2.5 * count), layout="constrained")
    panels = np.atleast_1d(figure.subplots(count, 1, sharex=True))
    for axes, name, values in zip(panels, result.static_columns[1:], result.statics.T[1:], strict=True):
        axes.plot(result.statics[:, 0], values)
        show_no_noise(axes, values, name.partition("[")[2].rstrip("]"))
        axes.set_ylabel(name)
        axes.grid(visible=True, alpha=0.4)
    panels[-1].set_xlabel(result.static_columns[0])
    set_heading(figure, result.title)
    return figure
