"""Stopping a run in which a pantograph has lost the wire for good."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from master.coupling.network import Network
from master.errors import RunError
from master.system.contacts import Contact

#: A contact lost for longer than this, once it has been made, will not come back [s].
LONGEST_LOSS: Final = 1.0


class ContactLossStop:
    """Observer that ends the run when a contact, once made, stays lost.

    Parameters
    ----------
    contacts : sequence of Contact
        The contacts to watch.
    network : Network
        The network that will be run.
    longest : float
        Loss after which the run is stopped [s].
    """

    name = "contact loss"

    def __init__(self, contacts: Sequence[Contact], network: Network, longest: float = LONGEST_LOSS) -> None:
        self._contacts = tuple(contacts)
        self._places = {name: i for i, name in enumerate(network.output_names)}
        self._forces = [self._places[c.force] for c in contacts]
        self._last: list[float | None] = [None] * len(self._contacts)
        self._longest = longest

    def begin(self, time: float, network: Network) -> None:
        """Nothing is lost before contact was made."""

    def observe(self, index: int, time: float, network: Network) -> None:
        """Look at the forces."""
        for i, place in enumerate(self._forces):
            if network.outputs.item(place) > 0.0:
                self._last[i] = time
            elif (last := self._last[i]) is not None and time - last > self._longest:
                raise RunError(self._lost(self._contacts[i], last, network))

    def finish(self) -> None:
        """Nothing to close."""

    def save(self) -> list[float | None]:
        """Return when each contact was last seen."""
        return list(self._last)

    def restore(self, memory: Sequence[float | None]) -> None:
        """Continue from what another observer of the same contacts has seen."""
        self._last = list(memory)

    def _lost(self, contact: Contact, last: float, network: Network) -> str:
        where = [
            f"end {end} at {axis} = {network.outputs[place]:.3f} m"
            for end in "AB"
            for axis in "xyz"
            if (place := self._places.get(contact.end(end, axis))) is not None
        ]
        strip = f" (strip: {', '.join(where)})" if where else ""
        return (
            f"component '{contact.pantograph}' has left the wire: no contact since t = {last:.6g} s{strip}; "
            "check uplift force, start position and stagger"
        )
