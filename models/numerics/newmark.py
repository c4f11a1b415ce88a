"""Newmark's trapezoidal rule with a fixed step [2.20-2.28]."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class Newmark:
    """Coefficients of the implicit Newmark method, gamma = 1/2, beta = 1/4 (unconditionally stable).

    With a_n+1 = a0 (d_n+1 - d_n) - a2 v_n - a3 a_n and v_n+1 = a1 (d_n+1 - d_n) - a4 v_n - a5 a_n the
    equation of motion becomes K_hat d_n+1 = f + M (a0 d + a2 v + a3 a) + C (a1 d + a4 v + a5 a),
    K_hat = K + a0 M + a1 C.

    Attributes
    ----------
    step : float
        Time step [s].
    """

    step: float
    gamma: float = 0.5
    beta: float = 0.25

    @cached_property
    def a0(self) -> float:
        """Return 1 / (beta dt^2)."""
        return 1.0 / (self.beta * self.step**2)

    @cached_property
    def a1(self) -> float:
        """Return gamma / (beta dt)."""
        return self.gamma / (self.beta * self.step)

    @cached_property
    def a2(self) -> float:
        """Return 1 / (beta dt)."""
        return 1.0 / (self.beta * self.step)

    @cached_property
    def a3(self) -> float:
        """Return 1 / (2 beta) - 1."""
        return 0.5 / self.beta - 1.0

    @cached_property
    def a4(self) -> float:
        """Return gamma / beta - 1."""
        return self.gamma / self.beta - 1.0

    @cached_property
    def a5(self) -> float:
        """Return dt / 2 (gamma / beta - 2)."""
        return 0.5 * self.step * (self.gamma / self.beta - 2.0)


def steps_within(duration: float, longest: float) -> int:
    """Return the number of equal steps of at most ``longest`` that divide a duration.

    Examples
    --------
    >>> steps_within(1e-3, 1e-3), steps_within(2e-3, 1e-3), steps_within(1.5e-3, 1e-3)
    (1, 2, 2)
    """
    return max(1, -int(-(duration / longest) * (1.0 - 1e-9) // 1))
