"""The rows of ``asbuilt``: what was found in figures, and every dropper with its verdict and its change."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.interface.norm_judgement import verdict_word
from models.layout.as_built.as_built_outcome import AGREEMENT, AsBuiltOutcome

#: Columns of what is printed and shown of a dropper.
COLUMNS: Final = (
    "span", "dropper", "x [m]", "error [mm]", "std. error [mm]", "verdict", "change [mm]", "cut to [m]",
    "height, before [mm]", "after [mm]", "force, before [N]", "after [N]",
)  # fmt: skip
#: Those that fit a terminal, by their places.
PRINTED: Final = (0, 1, 2, 3, 4, 5, 6, 8, 9)
_FILE: Final = (
    "section", "span", "dropper", "x [m]", "length designed [m]", "length as fitted [m]", "error [mm]",
    "standard error [mm]", "slack", "verdict", "change [mm]", "length corrected [m]", "height designed [m]",
    "height measured [m]", "height as built [m]", "height expected [m]", "force designed [N]", "force as built [N]",
    "force expected [N]",
)  # fmt: skip


def summary(found: AsBuiltOutcome) -> list[tuple[str, str]]:
    """Return the figures of a line as built: what, value with unit."""
    b, c = found.built, found.corrections
    measured, changed = b.is_measured, found.change != 0.0
    error = b.error[measured]
    slack = int((b.is_slack & measured).sum())
    beyond = int(found.is_beyond.sum())
    return [
        ("run", f"{b.run.source}: {len(b.run.position)} rows over {b.run.way:.1f} m"),
        ("alignment", _alignment(found)),
        ("droppers measured", f"{measured.sum()} of {len(measured)}"),
        *_scatter(found),
        ("error of lengths, largest and root mean square [mm]", _heights(error)),
        ("their standard error, median and largest [mm]", _errors(b.uncertainty[measured])),
        (f"droppers beyond {1e3 * found.tolerance:g} mm", f"{beyond}"),
        ("droppers slack, or too light to tell", f"{slack}"),
        ("both ways to the errors differ by [mm]", _difference(b.difference)),
        ("droppers to change", f"{changed.sum()}"),
        *([("changes taken back by a step, or a dropper were slack", f"{c.taken_back}")] if c.taken_back else []),
        ("heights off the design, largest and r.m.s. [mm]", _heights(found.before[measured])),
        ("expected with these changes [mm]", _heights(found.after[measured])),
        ("running surface beyond the static shape [mm]", _surface(found)),
    ]


def dropper_rows(found: AsBuiltOutcome) -> Iterator[tuple[str, ...]]:
    """Yield a row of `COLUMNS` for every dropper."""
    b = found.built
    before, after, change = found.before, found.after, found.change
    lengths, forces = _lengths(found)[2], _forces(found)
    for k, ((_, span, dropper), verdict) in enumerate(zip(found.places(), found.verdicts, strict=True)):
        measured = bool(b.is_measured[k])
        yield (
            str(span),
            str(dropper),
            f"{b.x[k]:.2f}",
            _mm(b.error[k]) if measured else "-",
            f"{1e3 * b.uncertainty[k]:.1f}" if math.isfinite(b.uncertainty[k]) else "-",
            verdict,
            f"{1e3 * change[k]:+.0f}" if change[k] and _is_whole(change[k]) else _mm(change[k]) if change[k] else "",
            f"{lengths[k]:.4f}" if change[k] else "",
            f"{1e3 * before[k]:+.1f}",
            f"{1e3 * after[k]:+.1f}",
            f"{forces[1][k]:.1f}",
            f"{forces[2][k]:.1f}",
        )


def droppers_csv(found: AsBuiltOutcome) -> str:
    """Return the table of all droppers as CSV."""
    b, text = found.built, io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_FILE)
    lengths, forces, change = _lengths(found), _forces(found), found.change
    built, expected = found.before + b.wanted, found.after + b.wanted
    for k, (place, verdict) in enumerate(zip(found.places(), found.verdicts, strict=True)):
        numbers = (
            (b.x[k], 4),
            (lengths[0][k], 5),
            (lengths[1][k], 5),
            (1e3 * b.error[k], 3),
            (1e3 * b.uncertainty[k], 3),
        )
        rest = (
            (lengths[2][k], 5),
            *((z[k], 5) for z in (b.wanted, b.height, built, expected)),
            *((f[k], 2) for f in forces),
        )
        writer.writerow([
            *place, *(_number(*n) for n in numbers), int(b.is_slack[k]), verdict, _number(1e3 * change[k], 3),
            *(_number(*n) for n in rest),
        ])  # fmt: skip
    return text.getvalue()


def worst_rows(found: AsBuiltOutcome, most: int) -> list[tuple[str, ...]]:
    """Return the rows of droppers beyond the tolerance along the track, of the worst so many if there are more."""
    size = np.where(found.is_beyond, np.abs(found.built.error), 0.0)
    least = np.sort(size)[-most] if len(size) > most else 0.0
    return [row for row, error in zip(dropper_rows(found), size, strict=True) if error > 0.0 and error >= least]


def _number(value: float, digits: int) -> str:
    return f"{value + 0.0:.{digits}f}" if math.isfinite(value) else ""


def _is_whole(change: float) -> bool:
    return abs(1e3 * change - round(1e3 * change)) < 1e-6


def _lengths(found: AsBuiltOutcome) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unstrained lengths as designed, as fitted and as corrected, each of shape (k,) [m]."""
    b = found.built
    states = (b.design, b.fitted.state, found.corrections.state)
    first, second, third = (s.unstrained_length[b.droppers] for s in states)
    return first, second, third


def _forces(found: AsBuiltOutcome) -> tuple[FloatArray, FloatArray, FloatArray]:
    b = found.built
    states = (b.design, b.fitted.state, found.corrections.state)
    first, second, third = (s.dropper_force[b.droppers] for s in states)
    return first, second, third


def _alignment(found: AsBuiltOutcome) -> str:
    a = found.built.alignment
    if not a.by:
        return "none: positions as they are (the run has neither staggers nor structures of the design)"
    scale = f", stretched by {1e2 * a.scale:+.4f} % ({a.scale * found.built.run.way:+.2f} m)" if a.scale else ""
    how = f", correlation {a.correlation:.4f}" if math.isfinite(a.correlation) else f", {a.structures} of them"
    sure = f" (+- {a.standard_error:.2f} m, by the heights)" if math.isfinite(a.standard_error) else ""
    return f"by {a.by}: shifted by {a.shift:+.2f} m in its middle{sure}{scale}{how}"


def _scatter(found: AsBuiltOutcome) -> Iterator[tuple[str, str]]:
    known = [d for d in found.built.deviations if d is not None]
    sigma = [f"{1e3 * d.sigma:.2f}" if math.isfinite(d.sigma) else "unknown" for d in known]
    yield "scatter of heights about the course between droppers [mm]", ", ".join(sigma)
    outliers = np.concatenate([d.x[d.is_outlier] for d in known])
    if outliers.size:
        places = ", ".join(f"{x:.1f}" for x in outliers[:5]) + (" ..." if outliers.size > 5 else "")
        yield "heights far from their neighbours, left out", f"{outliers.size}, at {places} m"


def _surface(found: AsBuiltOutcome) -> str:
    s = found.surface
    if s.is_even:
        return "none: what is left is noise"
    noise = "; between droppers it is noise, and left out" if s.is_noise else ""
    return f"{_mm(_largest(s.r))} at most, {1e3 * _rms(s.r):.2f} r.m.s.{noise}"


def _difference(difference: float) -> str:
    if math.isnan(difference):
        return "not compared: no error up to 10 mm far from slack droppers"
    verdict = verdict_word(is_kept=difference <= AGREEMENT)
    ways = "form finding, and the inverse of the influences"
    return f"{1e3 * difference:.4f}: {verdict}, limit {1e3 * AGREEMENT:g} ({ways})"


def _heights(rise: FloatArray) -> str:
    return f"{_mm(_largest(rise))}, {1e3 * _rms(rise):.2f}"


def _errors(uncertainty: FloatArray) -> str:
    known = uncertainty[np.isfinite(uncertainty)]
    if not known.size:
        return "unknown: there are no more heights than droppers and arms"
    return f"{1e3 * float(np.median(known)):.2f}, {1e3 * float(known.max()):.2f}"


def _largest(values: FloatArray) -> float:
    return float(values[np.abs(values).argmax()]) if values.size else 0.0


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _mm(value: float) -> str:
    return f"{1e3 * value:+.1f}"
