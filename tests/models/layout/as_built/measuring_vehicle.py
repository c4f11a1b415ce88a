"""A measuring vehicle: heights and staggers of a line's wires with noise, its own origin, scale and gaps."""

import numpy as np

from models.catenary.statics.wire_course import section_alone, wire_courses
from models.layout.as_built.measured_run import MeasuredRun


def measured(state, rng, *, noise=0.0, origin=0.0, scale=0.0, every=0.5, gaps=(), uneven=None, margin=2.0, names=None):
    """Return the run of a vehicle under a line at rest, and the true place of every row.

    The vehicle's way is too short by the share ``scale`` about the middle of the line, and begins at another origin.
    """
    courses = wire_courses(state)
    start, end = min(c.x[0] for c in courses), max(c.x[-1] for c in courses)
    x = np.arange(start + margin, end - margin, every)
    which = section_alone(courses, x)
    for low, high in gaps:
        which[(x > low) & (x < high)] = -1
    x, which = x[which >= 0], which[which >= 0]
    height, stagger = (
        np.choose(which, [getattr(course, name)(x) for course in courses]) for name in ("height", "lateral")
    )
    if uneven is not None:
        height = height + uneven(x)
    middle = 0.5 * (start + end)
    structure = [""] * len(x)
    for place, name in (names or {}).items():
        structure[int(np.abs(x - place).argmin())] = name
    run = MeasuredRun(
        source="run.csv",
        position=middle + (x - middle) / (1.0 + scale) - origin,
        height=height + noise * rng.standard_normal(len(x)),
        stagger=stagger + (0.005 if noise else 0.0) * rng.standard_normal(len(x)),
        thickness=np.full(len(x), np.nan),
        structure=tuple(structure),
        row=tuple(range(2, len(x) + 2)),
    )
    return run, x
