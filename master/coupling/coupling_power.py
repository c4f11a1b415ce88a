"""How well the coupling conserves energy: the power residual at the interfaces.

At a contact the catenary gives the force F and receives the strip's velocity v', the pantograph receives F'
and gives v. What the pantograph loses, F' v, and what the catenary gains, F v', differ, because values are
exchanged only once per step. The difference is power that the coupling creates; its time integral is the
energy added to the system (positive) or taken from it. Components that extrapolate their inputs within the
step do better than this says: it is judged by the values at the communication points alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from master.arrays import FloatArray
from master.coupling.network import Network
from master.system.contacts import Contact


@dataclass(frozen=True)
class InterfacePower:
    """Power residual of one contact, in the vertical.

    Attributes
    ----------
    contact : int
        Index of the contact.
    energy : float
        Time integral of the residual [J]; positive is energy added.
    transferred : float
        Time integral of the magnitude of the power F v that passed [J], for comparison.
    rms : float
        Root mean square of the residual [W].
    """

    contact: int
    energy: float
    transferred: float
    rms: float


#: Floats, or arrays of samples.
_Values = TypeVar("_Values", float, FloatArray)


def power_residual(
    force_given: _Values, force_received: _Values, velocity_given: _Values, velocity_received: _Values
) -> _Values:
    """Return the power that the coupling adds [W].

    Parameters
    ----------
    force_given, force_received : float, or ndarray, shape (n,)
        Contact force that the catenary computed and that the pantograph used [N].
    velocity_given, velocity_received : float, or ndarray, shape (n,)
        Upward strip velocity that the pantograph computed and that the catenary used [m/s].
    """
    return force_given * velocity_received - force_received * velocity_given


@dataclass(frozen=True)
class _Port:
    """Places of a contact's force and of the velocities of the strip's ends among the outputs and the inputs."""

    contact: int
    given: tuple[int, int, int]
    received: tuple[int, int, int]


class CouplingPowerObserver:
    """Observer that sums up what is given and received at each contact.

    Parameters
    ----------
    contacts : sequence of Contact
        Contacts; those whose strip velocity is not exchanged are left out.
    network : Network
        The network that will be run.
    """

    name = "coupling power"

    def __init__(self, contacts: Sequence[Contact], network: Network) -> None:
        outputs = {n: i for i, n in enumerate(network.output_names)}
        inputs = {n: i for i, n in enumerate(network.input_names)}
        self._ports = [p for c in contacts if (p := _port(c, outputs, inputs)) is not None]
        # For each contact: sum of the residual, of the passed power, of the residual's square; and the steps.
        self._sums = [[0.0, 0.0, 0.0] for _ in self._ports]
        self._count = 0

    def begin(self, time: float, network: Network) -> None:
        """Nothing has passed yet."""

    def observe(self, index: int, time: float, network: Network) -> None:
        """Add the exchanged values of a step."""
        given, received = network.outputs.item, network.inputs.item
        for port, sums in zip(self._ports, self._sums, strict=True):
            # The strip's middle stands for the point of contact.
            (f, a, b), (f_received, a_received, b_received) = port.given, port.received
            force, velocity = given(f), 0.5 * (given(a) + given(b))
            residual = power_residual(
                force, received(f_received), velocity, 0.5 * (received(a_received) + received(b_received))
            )
            sums[0] += residual
            sums[1] += abs(force * velocity)
            sums[2] += residual * residual
        self._count += 1

    def finish(self) -> None:
        """Nothing to close."""

    def save(self) -> list[float | None]:
        """Return the sums, from which another observer of the same contacts continues."""
        return [float(self._count), *(value for sums in self._sums for value in sums)]

    def restore(self, memory: Sequence[float | None]) -> None:
        """Continue from the sums of another observer."""
        count, *values = (value or 0.0 for value in memory)
        self._count = round(count)
        self._sums = [values[i : i + 3] for i in range(0, len(values), 3)]

    def summary(self, step: float) -> tuple[InterfacePower, ...]:
        """Return the residuals of all contacts."""
        steps = max(self._count, 1)
        return tuple(
            InterfacePower(port.contact, residual * step, passed * step, math.sqrt(square / steps))
            for port, (residual, passed, square) in zip(self._ports, self._sums, strict=True)
        )


def _port(contact: Contact, outputs: dict[str, int], inputs: dict[str, int]) -> _Port | None:
    port = contact.prefix.removesuffix(".contact")
    given = (contact.force, contact.end("A", "vz"), contact.end("B", "vz"))
    received = (contact.force_input, f"{port}.A.vz", f"{port}.B.vz")
    if any(n not in outputs for n in given) or any(n not in inputs for n in received):
        return None
    f, a, b = (outputs[n] for n in given)
    f_received, a_received, b_received = (inputs[n] for n in received)
    return _Port(contact.index, (f, a, b), (f_received, a_received, b_received))
