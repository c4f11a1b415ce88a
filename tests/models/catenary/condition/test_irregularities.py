"""Errors of assembly: which number is whose, how large they are, and that one kind leaves the other alone."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from models.catenary.condition.irregularities import (
    dropper_length_errors,
    dropper_position_errors,
    stagger_errors,
    support_height_errors,
)
from models.catenary.definition.condition_definition import Irregularity
from models.catenary.shape.line_mesh import build_mesh
from models.library.catalogue import load_line
from models.numerics.random_numbers import normal_numbers


@pytest.fixture(scope="module")
def mesh():
    return build_mesh(load_line("LN2_overlap"))


def made(**values):
    sigmas = {"dropper_length": 0.01, "dropper_position": 0.03, "support_height": 0.02, "stagger": 0.04}
    return Irregularity(**({f"{kind}_sigma": sigma for kind, sigma in sigmas.items()} | {"seed": 4} | values))


@pytest.mark.parametrize("name", ["LN2_overlap", "Shinkansen"])
def test_numbers_are_drawn_section_by_section_along_the_track(name):
    """Hangers and droppers of a compound line in one row, hangers first where both hang at one place."""
    mesh = build_mesh(load_line(name))
    for errors, nodes, stream, sigma in (
        (dropper_length_errors(made(), mesh), mesh.droppers[:, 0], 1, 0.01),
        (dropper_position_errors(made(), mesh), mesh.droppers[:, 0], 2, 0.03),
        (support_height_errors(made(), mesh), mesh.support_nodes, 3, 0.02),
        (stagger_errors(made(), mesh), mesh.support_nodes, 4, 0.04),
    ):
        drawn = np.clip(normal_numbers(4, stream, len(nodes)), -3.0, 3.0)
        places = [(int(mesh.section[node]), float(mesh.points[node, 0])) for node in nodes]
        row = sorted(range(len(nodes)), key=places.__getitem__)
        assert errors[row].tolist() == (sigma * drawn).tolist()


@pytest.mark.parametrize("kind", ["dropper_length", "dropper_position", "support_height", "stagger"])
def test_a_kind_of_error_does_not_depend_on_another_ones_size(mesh, kind):
    errors = globals()[f"{kind}_errors"]
    others = {f"{k}_sigma": 0.3 for k in ("dropper_length", "dropper_position", "support_height", "stagger")}
    del others[f"{kind}_sigma"]
    alone, small, large = (errors(made(**values), mesh) for values in (dict.fromkeys(others, 0.0), {}, others))
    assert alone.tolist() == small.tolist() == large.tolist()
    assert alone.any()


def test_a_larger_sigma_scales_the_same_errors(mesh):
    small, large = (dropper_length_errors(made(dropper_length_sigma=s), mesh) for s in (0.01, 0.02))
    assert large == pytest.approx(2.0 * small, rel=1e-15)
    assert not np.array_equal(small, dropper_length_errors(made(seed=5), mesh))
    assert not dropper_length_errors(made(dropper_length_sigma=0.0), mesh).any()


def test_many_seeds_have_the_mean_and_deviation_wanted(mesh):
    """Within four standard errors; limiting to 3 sigma takes 1.3 % off the deviation."""
    drawn = np.concatenate([dropper_length_errors(made(seed=seed), mesh) for seed in range(200)])
    n = len(drawn)
    share = 1.0 - 2.0 * stats.norm.sf(3.0) - 6.0 * stats.norm.pdf(3.0) + 18.0 * stats.norm.sf(3.0)
    assert abs(drawn.mean()) < 4.0 * 0.01 / np.sqrt(n)
    assert drawn.std() == pytest.approx(0.01 * np.sqrt(share), rel=4.0 / np.sqrt(2.0 * n))
    assert np.abs(drawn).max() == pytest.approx(0.03, rel=1e-12)
    at_limit = np.count_nonzero(np.abs(drawn) > 0.03 - 1e-12)
    assert abs(at_limit - 0.0027 * n) < 4.0 * np.sqrt(0.0027 * n)


def test_hangers_are_cut_wrong_as_well():
    line = load_line("Shinkansen")
    mesh = build_mesh(line)
    errors = dropper_length_errors(dataclasses.replace(line.irregularity, dropper_length_sigma=0.01), mesh)
    assert errors.shape == mesh.is_hanger.shape
    assert errors[mesh.is_hanger].all()
