"""The moving picture as a file: GIF, or MP4 where ffmpeg is installed."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from master.arrays import FloatArray
from master.errors import MasterError
from master.report.charts.chart import COLOURS, GREY, MARK
from master.report.moving_picture import Movie, Rider
from master.safety.safe_files import atomic_file

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter

_ELSEWHERE: Final = "another file with --film"
_RATE: Final = 20
#: Half the width of the view [m].
_HALF: Final = 75.0


@dataclass(frozen=True)
class FilmOptions:
    """The options of a film.

    Attributes
    ----------
    magnification : float
        Factor by which the deformation of the wire is drawn larger.
    speed : float
        Simulated seconds per second of film.
    start, end : float, optional
        Track positions of the first pantograph where the film begins and ends [m].
    """

    magnification: float = 8.0
    speed: float = 0.5
    start: float | None = None
    end: float | None = None


def write_film(movie: Movie, path: Path, options: FilmOptions) -> Path:
    """Write the film.

    Raises
    ------
    MasterError
        If the ending is neither ``.gif`` nor ``.mp4``, or ffmpeg is missing.
    """
    from matplotlib.figure import Figure

    writer = _writer(path)
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    line_axes, force_axes = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    # The writers recognise the format by the ending, so the temporary file beside the film keeps it.
    with (
        atomic_file(path, _ELSEWHERE) as whole,
        tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.stem}.") as folder,
    ):
        temporary = Path(folder) / path.name
        with writer.saving(figure, str(temporary), dpi=100):
            for frame in _frames(movie, options):
                _draw_line(line_axes, movie, int(frame), options.magnification)
                _draw_force(force_axes, movie, int(frame))
                writer.grab_frame()
        temporary.replace(whole)
    return path


def check_name(path: Path) -> None:
    """Refuse a name that does not say of which of the two kinds a film is, or that leads nowhere."""
    if path.suffix not in (".gif", ".mp4"):
        raise MasterError(f"{path}: a film must be named .gif or .mp4")
    if not path.parent.is_dir():
        raise MasterError(f"{path}: there is no folder {path.parent}; make it, or name another place")


def _writer(path: Path) -> AbstractMovieWriter:
    from matplotlib.animation import FFMpegWriter, PillowWriter

    check_name(path)
    if path.suffix == ".gif":
        return PillowWriter(fps=_RATE)
    if not FFMpegWriter.isAvailable():
        raise MasterError("an MP4 film needs ffmpeg, which is not installed; write a .gif instead")
    return FFMpegWriter(fps=_RATE, codec="libx264", extra_args=["-pix_fmt", "yuv420p", "-crf", "26"])


def _frames(movie: Movie, options: FilmOptions) -> FloatArray:
    x = movie.riders[0].x
    first = 0 if options.start is None else int(np.searchsorted(x, options.start))
    last = len(x) - 1 if options.end is None else min(len(x) - 1, int(np.searchsorted(x, options.end)))
    seconds = movie.time[last] - movie.time[first] if last > first else 0.0
    return np.rint(np.linspace(first, last, max(2, round(seconds / options.speed * _RATE))))


def _draw_line(axes: Any, movie: Movie, frame: int, magnification: float) -> None:
    axes.clear()
    view, low, high = _view(movie, frame), _lowest(movie), max(s.line.messenger[1].max() for s in movie.sections)
    for index in range(len(movie.sections)):
        _draw_section(axes, movie, index, frame, magnification)
    for rider in movie.riders:
        _draw_pantograph(axes, movie, rider, frame, magnification)
    axes.set(xlim=view, ylim=(low - 0.9, high + 0.3), ylabel="height [m]")
    axes.set_title(f"t = {movie.time[frame]:.2f} s; deformation x {magnification:g}", loc="left", fontsize=9)


def _draw_section(axes: Any, movie: Movie, index: int, frame: int, magnification: float) -> None:
    section = movie.sections[index]
    line, x = section.line, section.line.droppers[0]
    feet = _moved(movie, index, frame, x, magnification)
    axes.vlines(line.supports, np.interp(line.supports, *line.wire) + 0.3, line.messenger[1].max() + 0.2, colors=MARK)
    for slack, colour, dash in ((False, MARK, "-"), (True, COLOURS[1], ":")):
        chosen = section.slack[frame] == slack
        tops = line.droppers[2][chosen]
        axes.vlines(x[chosen], feet[chosen], tops, colors=colour, linestyles=dash, linewidth=0.9)
    axes.plot(*line.messenger, color=GREY, linewidth=1.2)
    x0, x1 = _view(movie, frame)
    xs = np.linspace(max(x0, line.wire[0, 0]), min(x1, line.wire[0, -1]), 400)
    if xs[-1] > xs[0]:
        axes.plot(xs, _moved(movie, index, frame, xs, magnification), color=COLOURS[0], linewidth=2.0)


def _draw_pantograph(axes: Any, movie: Movie, rider: Rider, frame: int, magnification: float) -> None:
    x, line = rider.x[frame], movie.sections[rider.section[frame]].line
    z = np.interp(x, *line.wire) + magnification * rider.strip[frame]
    foot = _lowest(movie) - 0.9
    axes.plot([x - 1.0, x - 4.0, x], [foot, 0.5 * (foot + z), z], color="black", linewidth=1.6)
    axes.plot([x - 2.0, x + 2.0], [z, z], color=COLOURS[1], linewidth=3.5)


def _lowest(movie: Movie) -> float:
    return min(float(s.line.wire[1].min()) for s in movie.sections)


def _moved(movie: Movie, index: int, frame: int, x: FloatArray, magnification: float) -> FloatArray:
    """Return the height of a section's contact wire with its deformation magnified."""
    section = movie.sections[index]
    points, values = list(section.points), list(section.displacement[frame])
    for rider in movie.riders:
        if rider.section[frame] == index and np.isfinite(rider.wire[frame]):
            points.append(rider.x[frame])
            values.append(rider.wire[frame])
    order = np.argsort(points, kind="stable")
    displacement = np.interp(x, np.array(points)[order], np.array(values)[order])
    return np.interp(x, *section.line.wire) + magnification * displacement


def _draw_force(axes: Any, movie: Movie, frame: int) -> None:
    axes.clear()
    x0, x1 = _view(movie, frame)
    for i, rider in enumerate(movie.riders):
        past = slice(0, frame + 1)
        axes.plot(rider.x[past], rider.force[past], color=GREY, linewidth=0.7)
        style = {"color": COLOURS[i % len(COLOURS)], "linestyle": "--" if i else "-", "linewidth": 1.8}
        axes.plot(rider.x[past], rider.filtered[past], **style)
    most = max(float(np.nanmax(r.filtered, initial=200.0)) for r in movie.riders)
    axes.set(xlim=(x0, x1), ylim=(0.0, 1.05 * most), ylabel="contact force [N]", xlabel="track position [m]")


def _view(movie: Movie, frame: int) -> tuple[float, float]:
    xs = [float(rider.x[frame]) for rider in movie.riders]
    half = max(_HALF, 0.5 * (max(xs) - min(xs)) + 30.0)
    middle = 0.5 * (max(xs) + min(xs))
    return middle - half, middle + half
