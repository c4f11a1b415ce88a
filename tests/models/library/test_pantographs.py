"""Every lumped pantograph of the library says what its source says, and can be coupled."""

import numpy as np
import pytest

from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import load_pantograph
from models.pantograph.lumped.lumped_definition import read_lumped
from models.pantograph.lumped.lumped_model import LumpedModel

# Table 5.1, figure 3.5 and EN 50318: mass kg, stiffness N/m, damping N s/m, bottom to top.
PRINTED = {
    "CX": ((5.58, 178.45, 108.39), (8.78, 15487, 0.009), (7.75, 7000, 45.85)),
    "ATR95": ((10.14, 7247.6, 225.33), (13.05, 30274, 0.01), (9.45, 7978.7, 87.74)),
    "DSA380": ((7, 65.7, 500), (11, 6700, 0), (10.5, 20000, 200)),
    "generic": ((4.5, 62, 54), (6.3, 8000, 0), (7.8, 7000, 30)),
    "EN50318_2002": ((15, 50, 90), (7.2, 4200, 10)),
    "EN50318_2018": ((6, 160, 100), (9, 15500, 0.1), (7.5, 7000, 45)),
}


@pytest.mark.parametrize("name", PRINTED)
def test_stages_are_the_printed_ones(name):
    definition = load_pantograph(name)
    assert definition.name == name
    assert tuple((s.mass, s.stiffness, s.damping) for s in definition.stage) == PRINTED[name]
    assert all(value.source.strip() for value in definition.provenance.values())


@pytest.mark.parametrize("name", PRINTED)
def test_held_at_the_reference_height_the_static_force_is_the_contact_force(name):
    """What holds the strip down at its reference height is the static force, through every spring of the chain."""
    definition = load_pantograph(name)
    model = LumpedModel(definition)
    load = model.load(1.0, np.zeros(2))
    lower = np.linalg.solve(model.K[:-1, :-1], load[:-1])
    held = model.K[-1, :-1] @ lower
    serial = np.linalg.inv(model.K)[-1, -1]
    rise = (np.linalg.inv(model.K) @ load)[-1]
    assert -held == pytest.approx(rise / serial)
    assert 0.0 < -held <= definition.static_force


@pytest.mark.parametrize("name", PRINTED)
def test_modes_are_stable(name):
    model = LumpedModel(load_pantograph(name))
    assert (np.linalg.eigvalsh(model.K) > 0.0).all()
    assert (np.linalg.eigvalsh(model.C) >= -1e-9).all()


def test_mistakes_are_told_at_once():
    data = {
        "name": "bad",
        "type": "lumped",
        "static_force": [-1, "N", "test"],
        "colour": "red",
        "stage": [{"mass": [0, "kg", "test"], "stiffness": [1, "N.m", "test"], "damping": [1, "N.s/m", "test"]}],
    }
    with pytest.raises(DefinitionError) as caught:
        read_lumped(Table.from_dict(data, "bad.toml"))
    assert {p.key for p in caught.value.problems} == {"static_force", "colour", "stage[1].mass", "stage[1].stiffness"}
