"""The wind that a line is designed for, at rest."""

from __future__ import annotations

from dataclasses import dataclass

from models.definition_files.field_schema import part, quantity


@dataclass(frozen=True, kw_only=True)
class DesignWind:
    """A steady wind across the line: pressure 1/2 rho V^2 G_q, force per length q = pressure G_C C_C d on a wire."""

    speed: float = quantity(
        "m/s", "speed of the wind", default=29.0, positive=True, minimum=0.1, maximum=100.0, tunable=False
    )
    air_density: float = quantity("kg/m3", "density of the air", default=1.25, minimum=0.5, maximum=2.0, tunable=False)
    gust_factor: float = quantity(
        "1", "G_q, by which gusts raise the pressure", default=1.0, minimum=0.5, maximum=5.0, tunable=False
    )
    structure_factor: float = quantity(
        "1", "G_C, what of a gust a span meets at once", default=0.75, minimum=0.1, maximum=1.5, tunable=False
    )
    drag: float = quantity("1", "C_C, drag of a wire", default=1.0, minimum=0.1, maximum=3.0, tunable=False)

    @property
    def pressure(self) -> float:
        """Return 1/2 rho V^2 G_q [Pa].

        Examples
        --------
        >>> round(DesignWind(speed=29.0, air_density=1.2697, gust_factor=1.8).pressure, 2)
        961.04
        """
        return 0.5 * self.air_density * self.speed**2 * self.gust_factor

    def force(self, diameter: float, pressure: float | None = None) -> float:
        """Return the force per length on a wire of some diameter [N/m], under a given pressure or the wind's own."""
        found = self.pressure if pressure is None else pressure
        return found * self.structure_factor * self.drag * diameter


@dataclass(frozen=True, kw_only=True)
class Wind:
    """Winds on the line."""

    design: DesignWind = part(DesignWind, default=DesignWind())
