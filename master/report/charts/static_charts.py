"""Plots of a run. Every function returns a Matplotlib figure and touches nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from master.arrays import FloatArray
from master.evaluation.contact_signals import Signals
from master.evaluation.line_geometry import Uplift, aligned, by_section, indexed, met
from master.results.run_results import Results

_COLOURS: Final = ("#1f5fa8", "#c2571a", "#2e7d4f", "#7b3fa0")
_GREY: Final = "#9aa0a6"
_INTERVAL: Final = "#f4e7b4"


def all_plots(results: Results) -> dict[str, Figure]:
    """Return every plot that the run has the data for, by file name without ending."""
    found = {
        "contact_force": contact_force(results),
        "uplift": uplift(results),
        "uplift_history": uplift_history(results),
        "contact_height": contact_height(results),
        **{f"line_{name}": geometry(values) for name, values in results.geometry.items()},
    }
    return {name: figure for name, figure in found.items() if figure is not None}


def contact_force(results: Results) -> Figure | None:
    """Contact force, raw and low-passed, over track position; supports, droppers and interval are marked."""
    if not results.signals:
        return None
    figure, rows = _figure(len(results.signals), height=3.4)
    for i, (axes, s) in enumerate(zip(rows, results.signals, strict=True)):
        _mark_line(axes, results, s.contact.catenary, (float(s.position.min()), float(s.position.max())))
        axes.plot(s.position, s.raw, color=_GREY, linewidth=0.6, label="raw")
        axes.plot(s.position, s.shown, color=_COLOURS[i % len(_COLOURS)], linewidth=1.3, label=s.filter.band)
        axes.set_ylabel(f"contact force [N]\n{s.contact.pantograph}")
        axes.set_ylim(*_force_range(s))
        axes.legend(loc="lower left", ncols=5, frameon=False, bbox_to_anchor=(0.0, 1.0), fontsize=8)
    rows[-1].set_xlabel("track position of the contact [m]")
    return figure


def uplift(results: Results) -> Figure | None:
    """Largest uplift of every support as bars."""
    uplifts = results.uplifts
    if not uplifts:
        return None
    figure, (axes,) = _figure(1, height=3.0)
    labels = [_support_label(u) for u in uplifts]
    axes.bar(range(len(uplifts)), [1e3 * u.maximum for u in uplifts], color=_COLOURS[0], width=0.7)
    axes.set_xticks(range(len(uplifts)), labels, rotation=60, ha="right", fontsize=8)
    axes.set_xlabel("support at [m]" if uplifts[0].x is not None else "support number")
    axes.set_ylabel("largest uplift [mm]")
    return figure


def _support_label(u: Uplift) -> str:
    where = f"{u.x:.0f}" if u.x is not None else str(u.support)
    return where if u.section is None else f"{where} ({u.section})"


def uplift_history(results: Results, most: int = 8) -> Figure | None:
    """Uplift of the supports in the interval of interest over time."""
    chosen = [u for u in results.uplifts if u.stands_in(results.interval)] or list(results.uplifts)
    if not chosen:
        return None
    figure, (axes,) = _figure(1, height=3.0)
    for u in chosen[:: max(1, -(-len(chosen) // most))]:
        name = f"{u.component}.support[{u.support}].uplift"
        recording = next(r for r in results.recordings if name in r)
        axes.plot(recording.time, 1e3 * recording[name], linewidth=1.0, label=u.place)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("uplift [mm]")
    axes.legend(loc="upper left", ncols=2, frameon=False, fontsize=8)
    return figure


def contact_height(results: Results) -> Figure | None:
    """Height of the contact point over track position."""
    drawn = [s for s in results.signals if s.height is not None]
    if not drawn:
        return None
    figure, (axes,) = _figure(1, height=3.0)
    for i, s in enumerate(drawn):
        if i == 0:
            _mark_line(axes, results, s.contact.catenary, (float(s.position.min()), float(s.position.max())))
        axes.plot(s.position, s.height, color=_COLOURS[i % len(_COLOURS)], linewidth=1.1, label=s.contact.pantograph)
    axes.set_xlabel("track position of the contact [m]")
    axes.set_ylabel("contact height [m]")
    axes.legend(loc="lower left", ncols=5, frameon=False, bbox_to_anchor=(0.0, 1.0), fontsize=8)
    return figure


def geometry(values: dict[str, float]) -> Figure | None:
    """Return static line geometry: elevation and plan, of every section."""
    if not len(indexed(values, "support", "x")) or not len(indexed(values, "dropper", "x")):
        return None
    figure, (elevation, plan) = _figure(2, height=2.6)
    for section in by_section(values):
        droppers = aligned(section, "dropper", ("x", "upper.z", "lower.z", "lower.y"))
        supports = aligned(section, "support", ("x", "y", "z", "messenger_wire.z"))
        _draw_elevation(elevation, droppers, supports)
        _draw_plan(plan, droppers, supports)
    _one_legend(elevation)
    plan.set_xlabel("track position [m]")
    return figure


def _draw_elevation(axes: Any, droppers: dict[str, FloatArray], supports: dict[str, FloatArray]) -> None:
    x, low, high = droppers["x"], droppers["lower.z"], droppers["upper.z"]
    for one in zip(x, low, high, strict=True):
        axes.plot([one[0]] * 2, one[1:], color=_GREY, linewidth=0.6)
    wires = (
        ("contact wire", low, supports["z"], _COLOURS[0]),
        ("messenger wire", high, supports["messenger_wire.z"], _COLOURS[1]),
    )
    for label, at_droppers, at_supports, colour in wires:
        xs, zs = _merged(x, at_droppers, supports["x"], at_supports)
        axes.plot(xs, zs, color=colour, linewidth=1.1, label=label)
    axes.plot(supports["x"], supports["z"], "v", color="black", markersize=4, label="support")
    axes.set_ylabel("height [m]")


def _one_legend(axes: Any) -> None:
    """Draw the legend of the elevation, which names a thing once though every section has it."""
    handles, labels = axes.get_legend_handles_labels()
    named = dict(zip(labels, handles, strict=True))
    place = {"loc": "upper right", "bbox_to_anchor": (1.0, 1.18)}
    axes.legend(list(named.values()), list(named), ncols=3, frameon=False, fontsize=8, **place)


def _draw_plan(axes: Any, droppers: dict[str, FloatArray], supports: dict[str, FloatArray]) -> None:
    if not (np.isnan(droppers["lower.y"]).all() or np.isnan(supports["y"]).all()):
        xs, ys = _merged(droppers["x"], droppers["lower.y"], supports["x"], supports["y"])
        axes.plot(xs, ys, color=_COLOURS[0], linewidth=1.1)
        axes.plot(supports["x"], supports["y"], "v", color="black", markersize=4)
    axes.axhline(0.0, color=_GREY, linewidth=0.6)
    axes.set_ylabel("lateral [m]")


def _merged(x1: FloatArray, y1: FloatArray, x2: FloatArray, y2: FloatArray) -> tuple[FloatArray, FloatArray]:
    x, y = np.concatenate((x1, x2)), np.concatenate((y1, y2))
    x, y = x[np.isfinite(y)], y[np.isfinite(y)]
    order = np.argsort(x, kind="stable")
    return x[order], y[order]


def _figure(rows: int, height: float) -> tuple[Figure, Sequence[Any]]:
    figure = Figure(figsize=(9.0, 0.6 + height * rows), layout="constrained")
    made = [figure.add_subplot(rows, 1, i + 1) for i in range(rows)]
    for axes in made:
        axes.grid(axis="y", color="#e3e5e8", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        if axes is not made[0]:
            axes.sharex(made[0])
    return figure, made


def _mark_line(axes: Any, results: Results, catenary: str, shown: tuple[float, float]) -> None:
    """Mark interval of interest, supports (dashed) and droppers (ticks at the bottom)."""
    start, end = results.evaluated_interval
    if start is not None or end is not None:
        first, last = shown[0] if start is None else start, shown[1] if end is None else end
        axes.axvspan(first, last, color=_INTERVAL, alpha=0.6, linewidth=0, label="interval of interest")
    values = results.geometry.get(catenary, {})
    transform = axes.get_xaxis_transform()
    inside = met(values, "support", shown)
    axes.vlines(inside, 0.0, 1.0, transform=transform, color="#5f6368", linewidth=0.6, linestyle="--", label="support")
    axes.vlines(
        met(values, "dropper", shown),
        0.0,
        0.03,
        transform=transform,
        color="#5f6368",
        linewidth=0.6,
        label="dropper",
    )
    axes.set_xlim(*shown)


def _force_range(s: Signals) -> tuple[float, float]:
    """Return limits that show the whole filtered force and the raw force of the interval."""
    shown = s.shown[np.isfinite(s.shown)]
    top = max(float(shown.max(initial=1.0)), float(s.raw[s.inside].max(initial=0.0)))
    return min(0.0, float(shown.min(initial=0.0))), 1.05 * top
