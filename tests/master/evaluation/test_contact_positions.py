"""Where a contact is on the strip."""

import numpy as np
import pytest

from master.evaluation.contact_positions import lateral_position
from master.recording.recording import Recording
from master.system.contacts import Contact


def test_lateral_position_is_measured_from_the_strips_middle():
    contact = Contact(1, "c", "p", "c.contact")
    names = ("c.contact.force", "c.contact.y", "p.A.y", "p.B.y")
    values = np.array([[100.0, 0.15, 0.7, -0.5], [0.0, 0.2, 0.7, -0.5]])
    found = lateral_position(Recording(np.array([0.0, 1.0]), names, ("",) * 4, values), contact)
    assert found[0] == pytest.approx(0.05)
    assert np.isnan(found[1])
