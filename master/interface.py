"""How well the coupling conserves energy: the power residual at the interfaces.

At a contact the catenary gives the force F and is told the strip's velocity v', the pantograph is told F'
and gives v. What the pantograph loses, F' v, and what the catenary gains, F v', differ, because values are
exchanged only once per step. The difference is power that the coupling makes up; its time integral is the
energy added to the system (positive) or taken from it. Components that extrapolate their inputs within the
step do better than this says: it is judged by the values at the communication points alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from master.arrays import FloatArray
from master.contacts import Contact
from master.network import Network


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


def power_residual(
    force_given: FloatArray, force_told: FloatArray, velocity_given: FloatArray, velocity_told: FloatArray
) -> FloatArray:
    """Return the power that the coupling adds [W], shape (n,).

    Parameters
    ----------
    force_given, force_told : ndarray, shape (n,)
        Contact force that the catenary computed and that the pantograph used [N].
    velocity_given, velocity_told : ndarray, shape (n,)
        Upward strip velocity that the pantograph computed and that the catenary used [m/s].
    """
    return force_given * velocity_told - force_told * velocity_given


class PowerObserver:
    """Observer that collects what is given and told at each contact.

    Parameters
    ----------
    contacts : sequence of Contact
        Contacts; those whose strip velocity is not exchanged are left out.
    network : Network
        The network that will be run.
    rows : int
        Steps to expect.
    """

    def __init__(self, contacts: Sequence[Contact], network: Network, rows: int) -> None:
        self._outputs = {n: i for i, n in enumerate(network.output_names)}
        self._inputs = {n: i for i, n in enumerate(network.input_names)}
        self._contacts = [c for c in contacts if self._names(c) is not None]
        places = [p for c in self._contacts if (p := self._names(c)) is not None]
        self._given = np.array([i for given, _ in places for i in given], dtype=np.intp)
        self._told = np.array([i for _, told in places for i in told], dtype=np.intp)
        self._table: FloatArray = np.zeros((rows, 2, len(self._given)))
        self._count = 0

    def begin(self, time: float, network: Network) -> None:
        """Nothing has passed yet."""

    def observe(self, index: int, time: float, network: Network) -> None:
        """Keep the exchanged values of a step."""
        row = self._table[self._count]
        np.take(network.outputs, self._given, out=row[0], mode="clip")
        np.take(network.inputs, self._told, out=row[1], mode="clip")
        self._count += 1

    def finish(self) -> None:
        """Nothing to close."""

    def summary(self, step: float) -> tuple[InterfacePower, ...]:
        """Return the residuals of all contacts."""
        done = self._table[: self._count].reshape(self._count, 2, len(self._contacts), 3)
        return tuple(self._summarise(c.index, done[:, :, i], step) for i, c in enumerate(self._contacts))

    def _summarise(self, index: int, rows: FloatArray, step: float) -> InterfacePower:
        given, told = rows[:, 0], rows[:, 1]
        # force and the velocities of both ends; the strip's middle stands for the point of contact
        residual = power_residual(given[:, 0], told[:, 0], given[:, 1:].mean(axis=1), told[:, 1:].mean(axis=1))
        passed = np.abs(given[:, 0] * given[:, 1:].mean(axis=1))
        rms = float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0
        return InterfacePower(index, float(residual.sum() * step), float(passed.sum() * step), rms)

    def _names(self, contact: Contact) -> tuple[list[int], list[int]] | None:
        port = contact.prefix.removesuffix(".contact")
        given = [contact.force, contact.end("A", "vz"), contact.end("B", "vz")]
        told = [contact.force_input, f"{port}.A.vz", f"{port}.B.vz"]
        if any(n not in self._outputs for n in given) or any(n not in self._inputs for n in told):
            return None
        return [self._outputs[n] for n in given], [self._inputs[n] for n in told]
