"""A pantograph that has lost the wire for good."""

import numpy as np
import pytest

from master.coupling.contact_loss_stop import ContactLossStop
from master.coupling.network import Network
from master.errors import RunError
from master.system.contacts import Contact

CONTACT = Contact(1, "line", "pan", "line.contact")


def watched(fake_slave, forces, pause=None):
    line = fake_slave("line", (), ("contact.force",), np.zeros(1), lambda s, u, t, h: s)
    pan = fake_slave("pan", (), ("A.y",), np.array([0.9]), lambda s, u, t, h: s)
    network = Network([line, pan], [])
    network.outputs[1] = 0.9
    watch = ContactLossStop([CONTACT], network, 0.25)
    for n, force in enumerate(forces):
        if n == pause:  # the run is ended and goes on
            again = ContactLossStop([CONTACT], network, 0.25)
            again.restore(watch.save())
            watch = again
        network.outputs[0] = force
        watch.observe(n, 0.1 * n, network)


def test_a_lasting_loss_ends_the_run(fake_slave):
    with pytest.raises(RunError, match=r"'pan' has left the wire: no contact since t = 0\.1 s.*end A at y = 0\.900 m"):
        watched(fake_slave, [0.0, 5.0, 0.0, 0.0, 0.0])


def test_a_loss_is_not_forgotten_when_a_run_goes_on(fake_slave):
    with pytest.raises(RunError, match=r"no contact since t = 0\.1 s"):
        watched(fake_slave, [0.0, 5.0, 0.0, 0.0, 0.0], pause=3)


def test_short_losses_and_the_time_before_the_first_contact_do_not(fake_slave):
    watched(fake_slave, [0.0] * 20 + [5.0, 0.0, 0.0, 5.0, 0.0, 0.0])
