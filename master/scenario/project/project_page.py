"""The README of a project, which says what each file is, and the file that marks its folder."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from master.scenario.project.stretch import Stretch

PROJECT_FILE: Final = "openpanto.toml"
_MARK: Final = """\
# Marks the folder of an openpanto project. Its scenarios look for definitions in lines/ and pantographs/ here, before
# the folders of OPENPANTO_LIBRARY and the library.

name = "{name}"
"""
_LIFT: Final = (
    "The lifting force is constant: it depends neither on the speed nor on the direction of travel. Lumped pantographs "
    "hold it at every height (`follow_height` is 1; 0 leaves their lowest spring on the roof, as they were "
    "identified, and the force falls with the height); what a mechanism holds, its definition says (`cam`)."
)


def project_text(name: str) -> str:
    """Return the file that marks a project's folder."""
    return _MARK.format(name=name)


@dataclass(frozen=True)
class ProjectPage:
    """What the README of a project says.

    Attributes
    ----------
    name : str
    folder : str
        Name of the project's folder.
    definitions : mapping
        Files of own definitions, and what each was copied from.
    foreign : sequence of str
        FMUs from elsewhere.
    train : sequence of str
        Pantographs, the leading one first.
    calibrated : str
        Parameter that a calibration changes; empty for none.
    mean_force : float
        Wanted mean contact force [N].
    speed : float
        [m/s]
    way : Stretch
    supply : str
        Supply system whose limits apply.
    overlap : (float, float) or None
        Overlap of the line that lies in the interval [m].
    values : mapping
        What the scenario sets of each pantograph, in words; those that it sets nothing of are left out.
    own_start : mapping
        Pantographs that cannot be set to where they start or how fast they are, and which of these it is.
    has_own_lift : bool
        Whether a pantograph is made from a definition, so that it is known how it is lifted.
    """

    name: str
    folder: str
    definitions: Mapping[str, str]
    foreign: Sequence[str]
    train: Sequence[str]
    calibrated: str
    mean_force: float
    speed: float
    way: Stretch
    supply: str
    overlap: tuple[float, float] | None
    values: Mapping[str, str]
    own_start: Mapping[str, str]
    has_own_lift: bool

    def text(self) -> str:
        """Return the page, in Markdown."""
        commands = [("validate", "checks it"), ("run", "figures, verdict, and report.html in the folder results")]
        if self.calibrated:
            commands.insert(1, ("calibrate", "finds the lifting force for the wanted mean force"))
        return "\n".join(
            [
                f"# {self.name}",
                "",
                "In the folder that holds this one:",
                "",
                *(
                    f"    openpanto {verb} {shlex.quote(str(self.folder))}".ljust(44) + f"# {what}"
                    for verb, what in commands
                ),
                "",
                "| file | what it is |",
                "|---|---|",
                *(f"| `{file}` | {what} |" for file, what in self._files()),
                "",
                "What was chosen:",
                "",
                *(f"- {text}" for text in self._choices()),
                "",
                "More definitions: in this folder, `openpanto new-line NAME --like LN2` or `openpanto new-pantograph "
                "NAME --like CX`.",
                "",
            ]
        )

    def _files(self) -> Iterator[tuple[str, str]]:
        for file, origin in self.definitions.items():
            yield file, f"{origin}: edit it, and the next run builds its FMU again"
        scenario = f"{self.name}.ssp"
        yield (
            f"{scenario}/SystemStructure.ssd",
            "the scenario: what is coupled, interval of interest, settings of the run",
        )
        for name, values in self.values.items():
            yield f"{scenario}/{name}.ssv", f"values of `{name}`: {values}"
        yield f"{scenario}/resources/", "the FMUs; those of definitions are built when they are needed"
        for file in self.foreign:
            yield f"{scenario}/resources/{file}", "an FMU from elsewhere, used as it is"
        yield PROJECT_FILE, "marks this folder: definitions are looked up here first"

    def _choices(self) -> Iterator[str]:
        start, end = (f"{x:g}" for x in self.way.interval)
        places = ", ".join(f"`{n}` at {x:g} m" for n, x in zip(self.train, self.way.starts, strict=True))
        yield f"Speed {self.speed * 3.6:g} km/h; start of the strip: {places}."
        if self.overlap is not None:
            begin, after = (f"{x:g}" for x in self.overlap)
            yield f"Both sections of the line have wires from {begin} to {after} m: this overlap lies in the interval."
        yield f"Figures are taken from {start} to {end} m (`Interval`); 0.5 s after the last strip has passed, it ends."
        target = "the mean force that EN 50367 allows at most at this speed, "
        target += f"{self.supply} (recalled): {self.mean_force:.1f} N"
        if self.calibrated:
            yield f"`openpanto calibrate` seeks {target}, by `{self.calibrated}`; the value written is a first guess."
        else:
            yield f"Nothing is calibrated, as no lifting force of `{self.train[0]}` is known; compare with {target}."
        if self.calibrated and len(self.train) > 1:
            yield "The other pantographs are calibrated by `--parameter`, as in `--parameter trailing.static_force`."
        for name, lacking in self.own_start.items():
            yield (
                f"`{name}` has no parameter that sets its {lacking}, which must be as said above by itself. The "
                f"run ends at {self.way.stop:g} s."
            )
        if self.has_own_lift:
            yield _LIFT
