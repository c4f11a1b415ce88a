"""A line as it hangs, from a measuring run: lengths of its droppers as fitted, and what to correct."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from models.arrays import FloatArray
from models.catenary.condition.fitted_lengths import droppers_along
from models.catenary.definition.surface_definition import RunningSurface
from models.catenary.shape.form_finding import StaticState
from models.definition_files.parameter import ParameterError
from models.interface.column_frames import Table, Tabled
from models.interface.line_and_pantograph import Line, open_line
from models.interface.line_statics import given
from models.layout.as_built.as_built_outcome import AsBuiltOutcome, judge_as_built
from models.layout.as_built.dropper_corrections import Allowed
from models.layout.as_built.measured_reading import read_measured_run
from models.library.norm_tables import support_limits

#: What a tolerance or a step may be [m].
_SIZES: Final = (1e-4, 0.5)


@dataclass(frozen=True)
class LineAsBuilt(Tabled):
    """A line as it hangs, and as it would be corrected; SI.

    Attributes
    ----------
    line : Line
        With its droppers as fitted, and what is left of the heights as its running surface.
    corrected : Line
        The same with the changes.
    shift, scale, correlation : float
        Of the run's positions in its middle [m], and of its way; of the staggers, NaN if they did not take part.
    verdicts : tuple of str
        On every dropper, in the order of the table.
    difference : float
        By how much two ways to the errors differ, of errors up to 10 mm [m]; NaN if there were none to compare.
    outcome : AsBuiltOutcome
        All that was found; no promise is kept for this attribute.
    """

    line: Line
    corrected: Line
    shift: float
    scale: float
    correlation: float
    verdicts: tuple[str, ...] = field(repr=False)
    difference: float
    outcome: AsBuiltOutcome = field(repr=False)

    @property
    def tables(self) -> dict[str, Table]:
        """Columns by name: ``droppers``, with NaN where nothing was measured, and ``running_surface``."""
        found = self.outcome
        b, titles = found.built, ("x [m]", "error [mm]", "standard error [mm]", "slack", "change [mm]")
        heights = ("height designed [m]", "height measured [m]", "height as built [m]", "height expected [m]")
        errors = b.x, 1e3 * b.error, 1e3 * b.uncertainty
        built, expected = found.before + b.wanted, found.after + b.wanted
        return {
            "droppers": (
                (*titles, *heights),
                (*errors, b.is_slack, 1e3 * found.change, b.wanted, b.height, built, expected),
            ),
            "running_surface": (("position [m]", "height [mm]"), (found.surface.x, 1e3 * found.surface.r)),
        }


def as_built(
    line: Line | str | Path,
    run: str | Path,
    *,
    tolerance: float | str = "10 mm",
    step: float | str = "5 mm",
    only: int | None = None,
) -> LineAsBuilt:
    """Find how the droppers of a line are cut from a measuring run, and which to change by how much.

    Parameters
    ----------
    line : Line, str or Path
        The design: from `open_line`, or what it takes.
    run : str or Path
        CSV or XLSX file: position, height, and stagger, thickness, structure if measured.
    tolerance, step : float or str
        Of dropper lengths, and of which changes are multiples, in m or with a unit.
    only : int, optional
        Change so many droppers alone, the most useful ones.

    Raises
    ------
    ParameterError
        If the run says nothing reliable of this line, or an argument cannot be meant.
    DefinitionError
        With every mistake of the table.
    """
    design = line if isinstance(line, Line) else open_line(line)
    sizes = {"tolerance": given("tolerance", tolerance, "m"), "step": given("step", step, "m")}
    for name, size in sizes.items():
        if not _SIZES[0] <= size <= _SIZES[1]:
            raise ParameterError(f"{name}: {size:g} m is outside {_SIZES[0]:g} ... {_SIZES[1]:g} m")
    if only is not None and only < 1:
        raise ParameterError(f"only: {only} must be 1 or more droppers")
    allowed = Allowed(sizes["step"], only, support_limits().shortest_dropper)
    found = judge_as_built(design.definition, read_measured_run(Path(run)), sizes["tolerance"], allowed)
    alignment = found.built.alignment
    return LineAsBuilt(
        line=_with_errors(found, found.built.fitted.state, "asbuilt"),
        corrected=_with_errors(found, found.corrections.state, "corrected"),
        shift=alignment.shift,
        scale=alignment.scale,
        correlation=alignment.correlation,
        verdicts=found.verdicts,
        difference=found.built.difference,
        outcome=found,
    )


def _with_errors(found: AsBuiltOutcome, state: StaticState, name: str) -> Line:
    """Return the line with the errors of a state in its definition, and the running surface."""
    definition, mesh = found.built.definition, found.built.design.shape.mesh
    error: FloatArray = state.unstrained_length - found.built.design.unstrained_length
    sections = tuple(
        replace(section, length_errors=tuple(error[droppers_along(mesh, k)].tolist()))
        for k, section in enumerate(definition.sections)
    )
    surface = None
    if not found.surface.is_even:
        points = tuple(zip(found.surface.x.tolist(), found.surface.r.tolist(), strict=True))
        surface = RunningSurface(profile="running_surface.csv", points=points)
    return Line(replace(definition, name=name, sections=sections, running_surface=surface))
