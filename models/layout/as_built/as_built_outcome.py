"""All that a measuring run says of a line: errors with their verdicts, what is left, corrections and their effect."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.layout.as_built.as_built_line import AsBuilt, Tell, find_as_built, silent
from models.layout.as_built.dropper_corrections import Allowed, Corrections, correct
from models.layout.as_built.leftover_surface import LeftoverSurface, leftover_surface
from models.layout.as_built.measured_run import MeasuredRun

#: Both ways to the errors agree if they differ by no more than this, of errors up to 10 mm [m].
AGREEMENT: Final = 1e-4


@dataclass(frozen=True)
class AsBuiltOutcome:
    """A line as it hangs, and as it would be corrected; arrays over its droppers in the order of `AsBuilt`.

    Attributes
    ----------
    built : AsBuilt
    tolerance : float
        Of the lengths [m].
    surface : LeftoverSurface
    corrections : Corrections
        Its arrays over those droppers that were measured.
    """

    built: AsBuilt
    tolerance: float
    surface: LeftoverSurface
    corrections: Corrections

    @property
    def change(self) -> FloatArray:
        """Return by how much every dropper is to be lengthened [m], shape (k,)."""
        result = np.zeros(len(self.built.x))
        result[self.built.is_measured] = self.corrections.change
        return result

    @property
    def before(self) -> FloatArray:
        """Return the rise of the line as it hangs over the design, at every dropper [m], shape (k,)."""
        return self.built.heights(self.built.fitted.state) - self.built.wanted

    @property
    def after(self) -> FloatArray:
        """Return what of this is expected with the droppers changed [m], shape (k,)."""
        return self.built.heights(self.corrections.state) - self.built.wanted

    @property
    def is_beyond(self) -> BoolArray:
        """Return which droppers are beyond the tolerance, shape (k,)."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.abs(self.built.error) > self.tolerance)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Return the verdict on every dropper."""
        return tuple(self._verdicts())

    def places(self) -> Iterator[tuple[int, int, int]]:
        """Yield section, span and dropper, each counted from 1, of every dropper."""
        for s, section in enumerate(self.built.definition.sections, 1):
            for n, span in enumerate(section.spans, 1):
                yield from ((s, n, d) for d in range(1, len(span.droppers) + 1))

    def _verdicts(self) -> Iterator[str]:
        b = self.built
        for error, measured, slack, beyond in zip(b.error, b.is_measured, b.is_slack, self.is_beyond, strict=True):
            size = ("failed, too long" if error > 0.0 else "failed, too short") if beyond else "passed"
            if slack:
                size = "failed, slack and too long" if beyond and error > 0.0 else "slack"
            yield size if measured else "not measured"


def judge_as_built(
    definition: CatenaryDefinition, run: MeasuredRun, tolerance: float, allowed: Allowed, tell: Tell = silent
) -> AsBuiltOutcome:
    """Find a line as it hangs, and what to correct.

    Parameters
    ----------
    tolerance : float
        Of dropper lengths [m].

    Raises
    ------
    AsBuiltError
        If the definition is no design, or the run says nothing reliable of it.
    EquilibriumError
        If the line has no equilibrium as designed, as measured or as corrected.
    """
    built = find_as_built(definition, run, tell)
    surface = leftover_surface(built)
    measured = np.flatnonzero(built.is_measured)
    rise = (built.wanted - built.heights(built.fitted.state))[measured]
    count = len(measured) if allowed.only is None else min(allowed.only, len(measured))
    corrections = correct(
        built.design,
        built.fitted,
        built.droppers[measured],
        built.influence[measured][:, measured],
        rise,
        allowed,
        lambda done: tell("corrections", done, count),
    )
    return AsBuiltOutcome(built, tolerance, surface, corrections)
