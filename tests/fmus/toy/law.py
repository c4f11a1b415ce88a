"""The physics in which two toys may differ."""

from __future__ import annotations

GAIN = 1.0


def force(x, stiffness):
    return GAIN * stiffness * x
