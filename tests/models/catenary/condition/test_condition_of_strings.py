"""LN2's condition against two strings written from its data alone: no beams, no arms but their lift and swing."""

from dataclasses import replace

import numpy as np
import pytest

from models.catenary.condition.line_condition import find_condition
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.library.catalogue import load_line
from tests.models.conftest import make_fault

G, SPAN, SPANS, DX = 9.81, 49.5, 5, 0.75
TENSION = {"contact": 20e3, "messenger": 14e3}
DROPPERS = 4.5 + 6.75 * np.arange(7)
STIFFNESS = 12e-6 * 84.7e9  # of a dropper, times its length [N]
LATERAL = TENSION["contact"] * 2 * 0.4 / SPAN  # of a steady arm, of 1.22 m at 10 degrees
LIFT, SWING = LATERAL * np.tan(np.radians(10.0)), LATERAL / np.cos(np.radians(10.0)) / 1.22


class Strings:
    """Contact and messenger wire as strings over equal spans, heights of nodes every `DX`; its ends are held."""

    def __init__(self):
        self.n = round(SPANS * SPAN / DX) + 1
        self.supports = [round(k * SPAN / DX) for k in range(SPANS + 1)]
        self.droppers = [round((k * SPAN + x) / DX) for k in range(SPANS) for x in DROPPERS]
        self.load = {"contact": self._weight(1.334, 0.165), "messenger": self._weight(0.605, 0.195)}
        self.load["contact"][self.supports] += LIFT - 0.2 * G - 0.5 * 1.07 * 1.22 * G
        sag = 4.0 * 0.001 * SPAN * (DROPPERS - DROPPERS[0]) * (DROPPERS[-1] - DROPPERS) / np.ptp(DROPPERS) ** 2
        held = {**dict(zip(self.droppers, np.tile(5.08 - sag, SPANS), strict=True)), 0: 5.08, self.n - 1: 5.08}
        self.contact = solved(self._string("contact"), self.load["contact"], held)
        self.force = (self._string("contact") @ self.contact - self.load["contact"])[self.droppers]
        length = np.full(len(self.droppers), 1.2)
        for _ in range(3):
            load = self.load["messenger"].copy()
            load[self.droppers] -= self.force + 0.11 * G * length
            messenger = solved(self._string("messenger"), load, dict.fromkeys(self.supports, 6.48))
            length = (messenger - self.contact)[self.droppers]
        self.length, self.unstrained = length, length / (1.0 + self.force / STIFFNESS)

    def _weight(self, mass, clamp):
        load = np.full(self.n, -mass * G * DX)
        load[self.droppers] -= clamp * G
        return load

    def _string(self, wire):
        k = TENSION[wire] / DX
        return (
            np.diag(np.full(self.n, 2.0 * k)) - np.diag(np.full(self.n - 1, k), 1) - np.diag(np.full(self.n - 1, k), -1)
        )

    def at_rest(self, missing=None, longer=0.0, dropper=None):
        """Return heights of the contact wire and forces of the droppers, one of them missing or another longer."""
        n, pulls = self.n, np.arange(len(self.droppers)) != missing
        unstrained = self.unstrained + longer * (np.arange(len(self.droppers)) == dropper)
        half = np.where(pulls, 0.0, 0.5)
        for _ in range(20):
            stiffness = np.where(pulls, STIFFNESS / self.unstrained, 0.0)
            whole = np.zeros((2 * n, 2 * n))
            whole[:n, :n], whole[n:, n:] = self._string("contact"), self._string("messenger")
            load = np.concatenate([self.load["contact"], self.load["messenger"]])
            whole[self.supports, self.supports] += SWING
            load[self.supports] += SWING * self.contact[self.supports]
            for node, k, l0, own, m in zip(self.droppers, stiffness, unstrained, half, self.length, strict=True):
                pair = np.ix_([node, n + node], [node, n + node])
                whole[pair] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
                # A missing one leaves half of its weight on each wire.
                load[[node, n + node]] += np.array([-1.0, 1.0]) * k * l0 - 0.11 * G * m * np.array([own, 1.0 - own])
            held = {0: 5.08, n - 1: 5.08, **{n + s: 6.48 for s in self.supports}}
            z = solved(whole, load, held)
            stretch = (z[n:] - z[:n])[self.droppers] - unstrained
            now = (stretch > 0.0) & (np.arange(len(self.droppers)) != missing)
            if np.array_equal(now, pulls):
                break
            pulls = now
        return z[:n], stiffness * stretch


def solved(matrix, load, held):
    """Solve for heights of which some are held, by node."""
    z = np.zeros(len(load))
    z[list(held)] = list(held.values())
    free = np.setdiff1d(np.arange(len(load)), list(held))
    z[free] = np.linalg.solve(matrix[np.ix_(free, free)], (load - matrix @ z)[free])
    return z


@pytest.fixture(scope="module")
def strings():
    return Strings()


@pytest.fixture(scope="module")
def line():
    return load_line("LN2")


def condition(line, fault):
    """Return what a fault of a dropper of LN2's fourteenth span does: rise of droppers and of the support before it."""
    design = kept_form(line, build_mesh(line))
    found = find_condition(kept_form(faulty := replace(line, fault=(fault,)), build_mesh(faulty)))
    lower, supports = design.shape.mesh.droppers[:, 0], design.shape.mesh.support_nodes
    rise = (found.positions - design.positions)[:, 2]
    x = design.positions[:, 0]
    span = line.sections[0].spans[13]
    first = int(np.abs(x[lower] - span.droppers[0]).argmin())
    support = int(np.abs(x[supports] - span.start).argmin())
    return rise[lower], rise[supports[support]], found.dropper_force, first


def test_the_design_of_strings_is_that_of_the_line(strings, line):
    design = kept_form(line, build_mesh(line))
    (*_, first) = condition(line, make_fault(kind="dropper_slipped", span=14, dropper=1, value=0.0))
    assert strings.length[14:21] == pytest.approx(
        design.droppers.length[first : first + 7], abs=0.005
    )  # wires bend at clamps
    assert strings.force[14:21] == pytest.approx(design.dropper_force[first : first + 7], abs=3.0)


def test_a_missing_first_dropper_leaves_the_support_where_strings_do(strings, line):
    rise, support, force, first = condition(line, make_fault(kind="dropper_broken", span=14, dropper=1))
    z, expected = strings.at_rest(missing=14)
    change = z - strings.contact
    assert change[strings.supports[2]] == pytest.approx(support, abs=0.0012)
    assert change[strings.droppers[14]] == pytest.approx(rise[first], abs=0.0018)
    assert expected[[13, 15]] == pytest.approx(force[[first - 1, first + 1]], abs=4.0)
    assert -0.032 < support < -0.027


def test_a_dropper_that_is_too_long_lowers_the_line_as_it_does_strings(strings, line):
    rise, _, force, first = condition(line, make_fault(kind="dropper_slipped", span=14, dropper=4, value=0.01))
    z, expected = strings.at_rest(longer=0.01, dropper=17)
    assert (z - strings.contact)[strings.droppers[17]] == pytest.approx(rise[first + 3], abs=0.0001)
    assert expected[16:19] == pytest.approx(force[first + 2 : first + 5], abs=1.5)
