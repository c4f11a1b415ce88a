"""Stopping a run whose pantograph is not under the wire: it begins beyond it, runs off its end, or never touches it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from master.coupling.network import Network
from master.errors import RunError
from master.system.components import System
from master.system.contacts import Contact
from master.system.pantograph_motion import constant_speed, final_position, parameter_value

#: Calculated parameters of a line that ends: where its contact wires begin and end along the track [m].
BEGIN: Final = "contact_wire.begin"
END: Final = "contact_wire.end"
#: Time after the uplift acts fully in which a strip that can reach the wire has reached it [s].
LONGEST_RISE: Final = 1.0
#: Parameters of a pantograph that say when its uplift acts fully [s].
_RAISING: Final = ("raise_start", "raise_duration")


class OffWireStop:
    """Observer that ends a run whose pantograph is not under the wire.

    What an FMU does not give is not checked: where its wire ends, where a pantograph will be, when it is raised.

    Parameters
    ----------
    system : System
    contacts : sequence of Contact
        The contacts to watch.
    network : Network
        The network that will be run.
    geometry : callable
        Gives the calculated parameters, known once the run begins.
    """

    def __init__(
        self,
        system: System,
        contacts: Sequence[Contact],
        network: Network,
        geometry: Callable[[], Mapping[str, Mapping[str, float]]],
    ) -> None:
        self._system = system
        self._contacts = tuple(contacts)
        self._geometry = geometry
        self._places = {name: i for i, name in enumerate(network.output_names)}
        self._forces = [self._places[c.force] for c in self._contacts]
        self._has_touched = [False] * len(self._contacts)
        self._extents: list[tuple[float, float]] = []
        self._latest: list[float] = []

    def begin(self, time: float, network: Network) -> None:
        """Compare where the pantographs are and will be with where the wire is."""
        known = self._geometry()
        for contact in self._contacts:
            line = known.get(contact.catenary, {})
            extent = line.get(BEGIN, -math.inf), line.get(END, math.inf)
            self._extents.append(extent)
            self._latest.append(max(self._raised(contact), time) + LONGEST_RISE)
            self._check_start(contact, extent, network)
            self._check_stop(contact, extent)

    def observe(self, index: int, time: float, network: Network) -> None:
        """Look at the pantographs that have no contact."""
        for i, place in enumerate(self._forces):
            if network.outputs.item(place) > 0.0:
                self._has_touched[i] = True
            elif time > self._latest[i] and not self._has_touched[i]:
                raise RunError(self._never_touched(self._contacts[i], time, network))
            else:
                self._check_extent(self._contacts[i], self._extents[i], network)

    def finish(self) -> None:
        """Nothing to close."""

    def _raised(self, contact: Contact) -> float:
        """Return when a pantograph's uplift acts fully [s], infinite if its FMU does not say."""
        pantograph = self._system.component(contact.pantograph)
        times = [parameter_value(pantograph, name) for name in _RAISING]
        return self._system.start + sum(math.inf if t is None else t for t in times)

    def _position(self, contact: Contact, network: Network) -> float | None:
        places = [self._places.get(contact.end(end, "x")) for end in "AB"]
        found = [float(network.outputs[p]) for p in places if p is not None]
        return 0.5 * sum(found) if len(found) == 2 else None

    def _check_start(self, contact: Contact, extent: tuple[float, float], network: Network) -> None:
        x = self._position(contact, network)
        if x is not None and not extent[0] <= x <= extent[1]:
            raise RunError(
                f"'{contact.pantograph}' starts at {x:g} m, beyond the contact wire of '{contact.catenary}', "
                f"{extent[0]:g} m to {extent[1]:g} m: change its start_position"
            )

    def _check_stop(self, contact: Contact, extent: tuple[float, float]) -> None:
        pantograph = self._system.component(contact.pantograph)
        x, speed = final_position(self._system, pantograph), constant_speed(pantograph)
        if x is not None and speed and x > extent[1]:
            latest = math.floor(100.0 * (self._system.stop - (x - extent[1]) / speed)) / 100.0
            raise RunError(
                f"'{contact.pantograph}' would be at {x:g} m by the end of the run, beyond the contact wire of "
                f"'{contact.catenary}', which ends at {extent[1]:g} m: stop at {latest:g} s or earlier"
            )

    def _check_extent(self, contact: Contact, extent: tuple[float, float], network: Network) -> None:
        x = self._position(contact, network)
        if x is not None and not extent[0] <= x <= extent[1]:
            raise RunError(
                f"'{contact.pantograph}' has run off the contact wire of '{contact.catenary}' at x = {x:g} m (it lies "
                f"from {extent[0]:g} m to {extent[1]:g} m): stop earlier"
            )

    def _never_touched(self, contact: Contact, time: float, network: Network) -> str:
        strip = [self._places.get(contact.end(end, "z")) for end in "AB"]
        heights = [float(network.outputs[p]) for p in strip if p is not None]
        where = f" (its strip is at z = {sum(heights) / len(heights):.3f} m)" if heights else ""
        return (
            f"'{contact.pantograph}' has not touched the wire by t = {time:.6g} s, though its uplift acts{where}: "
            "check static force, reference_height, strip_length and strip_offset against the wire's height and stagger"
        )
