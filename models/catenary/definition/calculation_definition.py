"""How finely a line is computed: its mesh, and how much of its motion."""

from __future__ import annotations

from dataclasses import dataclass

from models.definition_files.field_schema import count, quantity


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Fineness of the mesh."""

    elements_between_droppers: int = count(
        "elements of contact and messenger wire between neighbouring droppers", default=6, minimum=1, maximum=64
    )


@dataclass(frozen=True, kw_only=True)
class Dynamics:
    """How much of the motion about the static shape is computed."""

    highest_frequency: float = quantity(
        "Hz", "natural frequency above which modes of the wires between attachments are left out; 0: none are",
        default=0.0, minimum=0.0, maximum=1e9,
    )  # fmt: skip
    geometric_stiffness: int = count(
        "whether the tension of droppers and steady arms holds them back as pendulums, by N/L across them: 1 yes, "
        "0 no, as in the 2012 thesis",
        default=1, minimum=0, maximum=1,
    )  # fmt: skip
