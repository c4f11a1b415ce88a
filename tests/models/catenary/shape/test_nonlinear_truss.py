"""Shape at rest and elasticity of library lines against a truss on exact geometry that takes nothing from the model.

A truss does not bend, so the lines are compared without bending. In theirs wires stay smooth all the same, which a
point force resents: what is left of the difference is that of the mesh, and halves with it.
"""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from models.catenary.line_model import CatenaryModel
from models.catenary.statics import elasticity
from tests.effort import IS_LONG, some
from tests.models.conftest import shortened
from tests.models.nonlinear_truss import Truss

FORCE = 100.0


def limp(name, elements, spans=None):
    """Return a line of wires that do not bend, all of it or with fewer spans."""
    line = shortened(name, spans).with_values({"mesh.elements_between_droppers": elements})
    wires = ("contact_wire", "messenger_wire")
    return dataclasses.replace(line, **{w: dataclasses.replace(getattr(line, w), bending_stiffness=0.0) for w in wires})


def places(line, truss):
    """Return the first support of the middle span, and the place in its middle that has a node [m]."""
    spans = line.sections[0].spans
    span = spans[len(spans) // 2]
    (chain,) = truss.mesh.contact_chains()
    x = truss.rest[chain.nodes, 0]
    return span.start, float(x[np.abs(x - 0.5 * (span.start + span.end)).argmin()])


def rises(model, at):
    return 1e3 * FORCE * elasticity.elasticity(model, np.array(at), FORCE).value


@pytest.mark.parametrize("name", some(["LN2", "EN50318_2018_AC_simple", "LN6"], "EN50318_2018_AC_simple"))
def test_a_line_hangs_and_gives_way_as_a_nonlinear_truss_does(name):
    line = limp(name, 16, None if IS_LONG else 8)
    model, truss = CatenaryModel(line), Truss(line)
    lower = model.mesh.droppers[:, 0]
    assert np.abs(truss.rest[lower, 2] - model.mesh.target).max() < 1e-4
    assert np.abs(truss.rest - model.static.positions).max() < 2e-3  # the messenger wire, whose mesh is a polygon
    at = places(line, truss)
    truth = np.array([1e3 * truss.uplift(x, FORCE) for x in at])
    found = rises(model, at)
    assert found[0] == pytest.approx(truth[0], rel=0.015)
    assert found[1] == pytest.approx(truth[1], rel=0.006)
    # Without N/l of arms and droppers a support would give way much too far.
    plain = rises(CatenaryModel(line.with_values({"dynamics.geometric_stiffness": 0})), at)
    assert plain[0] > 1.04 * truth[0]


def test_the_truss_has_the_figure_of_the_specification():
    """22.63 mm at a support of LN2 and 40.4 mm at mid-span under 100 N, whatever its mesh."""
    for elements in (6, 16):
        line = limp("LN2", elements)
        truss = Truss(line)
        support, middle = (1e3 * truss.uplift(x, FORCE) for x in places(line, truss))
        assert support == pytest.approx(22.63, abs=0.03)
        assert middle == pytest.approx(40.4, abs=0.05)
        assert 1e3 * truss.uplift(600.7, FORCE) == pytest.approx(22.63, abs=0.03)


@pytest.mark.slow
@pytest.mark.long
def test_what_is_left_of_the_difference_is_the_mesh():
    off = []
    for elements in (8, 16, 32):
        line = limp("LN2", elements)
        truss = Truss(line)
        at = places(line, truss)
        off.append(1.0 - rises(CatenaryModel(line), at)[0] / (1e3 * truss.uplift(at[0], FORCE)))
    assert 0.0 < off[-1] < 0.01
    assert all(finer < 0.7 * coarser for coarser, finer in pairwise(off))
