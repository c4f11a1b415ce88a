"""What is kept of mechanisms, where two threads ask for it at once."""

from types import SimpleNamespace

import numpy as np

from models.library.catalogue import load_pantograph
from models.pantograph.multibody.last_found import LastFound


class TakenMeanwhile(dict):
    """What is in it is gone as soon as somebody has asked whether it is."""

    def __contains__(self, key):
        found = super().__contains__(key)
        super().pop(key, None)
        return found


def test_what_another_thread_takes_meanwhile_is_found_again():
    lines = SimpleNamespace(free_length=np.zeros(1))
    definition = load_pantograph("generic_multibody_cam")
    mechanism = SimpleNamespace(definition=definition, forces=SimpleNamespace(lines=lines))
    last = LastFound(most=2)
    last._kept = TakenMeanwhile()
    found = [last.of(mechanism, np.array([place]), lambda place=place: place) for place in (1.0, 1.0, 2.0, 3.0, 1.0)]
    assert found == [1.0, 1.0, 2.0, 3.0, 1.0]
    assert list(last._kept.values()) == [3.0, 1.0]
