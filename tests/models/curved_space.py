"""A curved track in space: places in the turning rail plane as points in space, and back; no loads are here."""

from __future__ import annotations

import numpy as np

STEP = 0.01


class CurvedSpace:
    """The track's axis and rail plane, integrated from curvature and cant; z up, gravity along -z."""

    def __init__(self, track, start, end):
        self.x = np.arange(start, end + STEP, STEP)
        middle = 0.5 * (self.x[1:] + self.x[:-1])

        def integral(values):
            return np.concatenate([[0.0], np.cumsum(np.interp(middle, track.positions, values)) * STEP])

        self.heading, self.gradient = integral(track.curvatures), integral(track.vertical_curvatures)
        self.angle = np.arcsin(np.interp(self.x, track.positions, track.cants) / track.base)
        along = np.stack(
            [np.cos(self.heading) * np.cos(self.gradient), np.sin(self.heading) * np.cos(self.gradient),
             np.sin(self.gradient)], axis=1,
        )  # fmt: skip
        self.axis = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (along[1:] + along[:-1]) * STEP, axis=0)])

    def frame(self, x):
        """Return the axis' point and the unit vectors along, left and up in the rail plane at some x, (n, 3) each."""
        heading, gradient, angle = (np.interp(x, self.x, v) for v in (self.heading, self.gradient, self.angle))
        point = np.stack([np.interp(x, self.x, column) for column in self.axis.T], axis=-1)
        left = np.stack([-np.sin(heading), np.cos(heading), 0.0 * heading], axis=-1)
        along = np.stack(
            [np.cos(heading) * np.cos(gradient), np.sin(heading) * np.cos(gradient), np.sin(gradient)], axis=-1
        )
        up = np.cross(along, left)
        sine, cosine = np.sin(angle)[..., None], np.cos(angle)[..., None]
        return point, along, cosine * left - sine * up, sine * left + cosine * up

    def points(self, x, y, z):
        """Return points in space of places in the rail plane."""
        point, _, left, up = self.frame(x)
        return point + np.asarray(y)[..., None] * left + np.asarray(z)[..., None] * up

    def crossed(self, x, curve):
        """Return y and z at which a curve in space, share (0 ... 1) -> point, goes through the cross-section at x."""
        point, along, left, up = self.frame(np.array(x))
        low, high = 0.0, 1.0
        for _ in range(60):
            share = 0.5 * (low + high)
            low, high = (share, high) if (curve(share) - point) @ along < 0.0 else (low, share)
        offset = curve(share) - point
        return float(offset @ left), float(offset @ up)
