"""Heights by lengths: the printed figures, strings under tension, and the second equilibrium itself."""

import numpy as np
import pytest

from models.catenary.condition.fitted_lengths import droppers_along, with_errors
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.statics.dropper_influence import dropper_influence
from tests.models.conftest import make_line

#: The fourth dropper of the middle span of five of 49.5 m.
FOURTH = 2 * 7 + 3


@pytest.fixture(scope="module")
def design():
    """LN2's wires over five spans of 49.5 m, droppers 4.5 m from the supports and 6.75 m apart, sag from supports."""
    line = make_line(5, length=49.5)
    return kept_form(line, build_mesh(line))


def heights(state):
    return state.positions[state.shape.mesh.droppers[:, 0], 2]


def unit(dropper, size):
    return size * (np.arange(35) == dropper)


def test_ten_millimetres_on_the_fourth_dropper_do_what_is_printed(design):
    found = with_errors(design, unit(FOURTH, 0.01))
    assert 1e3 * (heights(found) - heights(design))[FOURTH] == pytest.approx(-4.09, rel=0.02)
    assert design.dropper_force[FOURTH - 1 : FOURTH + 2] == pytest.approx([68.7] * 3, rel=0.02)
    assert found.dropper_force[FOURTH - 1 : FOURTH + 2] == pytest.approx([81.2, 43.9, 81.2], rel=0.02)


def test_two_errors_add_up(design):
    one, other, both = (
        heights(with_errors(design, e)) - heights(design)
        for e in (unit(FOURTH, 1e-3), unit(FOURTH + 2, 1e-3), unit(FOURTH, 1e-3) + unit(FOURTH + 2, 1e-3))
    )
    assert np.abs(both - one - other).max() < 1e-6


def test_an_inner_dropper_lowers_the_wire_by_the_messengers_share_of_the_tension(design):
    """Two strings, the sum of whose tensions times heights stays: T_m / (T_c + T_m), at the dropper alone."""
    J = dropper_influence(design, np.arange(35)).toarray()
    column = J[:, FOURTH]
    assert column[FOURTH] == pytest.approx(-14.0 / 34.0, rel=0.005)
    assert np.abs(np.delete(column, FOURTH)).max() < 0.01


def test_influences_are_those_of_the_equilibrium(design):
    """Of outer droppers, which reach far, as of inner ones; with the weight of what they are longer."""
    told = []
    J = dropper_influence(design, droppers_along(design.shape.mesh, 0), told.append).toarray()
    for dropper in (14, FOURTH, 20):
        truth = (heights(with_errors(design, unit(dropper, 1e-4))) - heights(design)) / 1e-4
        assert np.abs(J[:, dropper] - truth).max() < 3e-4
    assert told == [35]
    chosen = np.array([3, 17, 20])
    assert np.abs(dropper_influence(design, chosen).toarray() - J[np.ix_(chosen, chosen)]).max() < 1e-12


def test_a_slack_dropper_has_no_influence(design):
    slack = with_errors(design, unit(FOURTH, 0.05))
    assert slack.is_slack[FOURTH]
    J = dropper_influence(slack, np.arange(35)).toarray()
    assert not J[:, FOURTH].any()
    assert J[FOURTH, FOURTH - 1] < -0.05
