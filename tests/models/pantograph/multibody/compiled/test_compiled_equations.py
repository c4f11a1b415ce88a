"""The general form in kernels against the same by array operations, element by element and in motion."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.library.catalogue import load_pantograph
from models.numerics.cubic_curve import CubicCurve
from models.numerics.kernel_cache import SWITCH, KernelError
from models.pantograph.multibody.base_motion import Sway
from models.pantograph.multibody.compiled import compiled_equations as compiled_equations_module
from models.pantograph.multibody.compiled import mechanism_tables
from models.pantograph.multibody.compiled.compiled_equations import compiled_equations
from models.pantograph.multibody.elements.angle_elements import Cam
from models.pantograph.multibody.elements.force_elements import KNOWN
from models.pantograph.multibody.mechanism import Inputs, Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble
from models.pantograph.multibody.mechanism_definition import (
    Aerodynamic,
    Bushing,
    LiftingForce,
    LiftingMoment,
    TurningFriction,
    WeightSpring,
)
from models.pantograph.multibody.mechanism_integrator import History, PlainEquations
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from models.pantograph.operation import Drive
from tests.models.pantograph.multibody.pantographs import rubbing_head, with_everything

SWAY = Sway((0.1, 0.2, 0.3), (0.05, 0.1, 0.2), (-0.03, 0.2, 0.1))
CURVE = CubicCurve(np.linspace(-0.5, 3.0, 8), np.cos(np.linspace(0.0, 2.0, 8)))
OTHER = CubicCurve(np.linspace(-0.4, 3.5, 6), np.exp(np.linspace(0.0, 1.0, 6)))


def with_more():
    """The pantograph with everything, and what the reduced form does not know."""
    d = with_everything()
    more = (
        Bushing(
            name="g", body_i="base", body_j="upper_arm", point_i=(0.1, 0.1, 0.3), point_j=(-0.2, 0.1, 0.0),
            translation_stiffness=(900.0, 700.0, 500.0), translation_damping=(20.0, 30.0, 40.0),
            rotation_stiffness=(60.0, 70.0, 80.0), rotation_damping=(5.0, 6.0, 7.0),
        ),
        Aerodynamic(name="w", body="horn", point=(0.1, 0.2, 0.3), direction=(0.6, 0.0, 0.8), coefficient=0.02),
        TurningFriction(name="f5", joint="joint_5", moment=3.0, transition=0.2),
        WeightSpring(name="c", body_i="base", body_j="lower_arm", point_i=(0.1, 0.0, 0.3), point_j=(0.2, 0.0, 0.1),
                     stiffness=2e3, damping=50.0),
    )  # fmt: skip
    return replace(d, forces=(*d.forces, *more))


def with_force(direction):
    """A pantograph that a force lifts, between two points or along a direction."""
    d = with_more()
    force = LiftingForce(
        name="lift", body_i="base", body_j="lower_arm", point_i=(-0.2, 0.1, 0.0), point_j=(0.5, 0.0, 0.2),
        direction=direction,
    )  # fmt: skip
    forces = tuple(force if isinstance(f, LiftingMoment) else f for f in d.forces)
    return replace(d, forces=forces, static_moment=None, static_force=900.0)


#: Name -> the pantograph, and the curves of its lift: of the cam (weights, per lift) and of a force besides.
CASES = {
    "cam": (lambda: load_pantograph("generic_multibody_cam"), (CURVE, OTHER), None),
    "moment": (with_more, None, OTHER),
    "force": (lambda: with_force(None), (None, OTHER), CURVE),
    "directed": (lambda: with_force((0.0, 0.6, 0.8)), None, None),
    "rubbing": (rubbing_head, None, None),
}


@pytest.fixture(scope="module")
def numba():
    pytest.importorskip("numba")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(SWITCH, "numba")
        yield


@pytest.fixture(scope="module", params=CASES)
def both(request, numba):
    made, cam, per_force = CASES[request.param]
    mechanism = Mechanism(made())
    y = assemble(mechanism)
    mechanism.forces.cam = None if cam is None else Cam(*cam)
    mechanism.forces.per_force = per_force
    return mechanism, y, PlainEquations(mechanism), compiled_equations(mechanism, y)


def states(mechanism, y, number=6):
    """States somewhat off the joints, whose bodies move apart from one another."""
    rng, n = np.random.default_rng(3), mechanism.count
    for _ in range(number):
        moved = y + 1e-3 * rng.standard_normal(13 * n)
        moved[7 * n :] = 0.5 * rng.standard_normal(6 * n)
        yield moved


def acting():
    """What acts on them, of every kind."""
    first = Inputs((0.1, 0.2, 0.5), 110.0, 120.0, 0.2, 10.0, None, 0.7, 60.0)
    return first, first._replace(sway=SWAY, force=0.0, uplift=0.0), first._replace(driven_lift=1200.0, against=-40.0)


def same(mine, theirs):
    """Compare to rounding, in units of the largest number."""
    mine, theirs = np.asarray(mine), np.asarray(theirs)
    assert np.abs(mine - theirs).max(initial=0.0) <= 1e-12 * max(1.0, np.abs(theirs).max(initial=0.0))


def test_kernels_give_the_plain_numbers(both):
    mechanism, start, plain, kernels = both
    for y in states(mechanism, start):
        for inputs in acting():
            for respond in (False, True):
                mine, theirs = (e.evaluate(y.copy(), inputs, respond=respond) for e in (kernels, plain))
                for name in ("rates", "acceleration", "multipliers") + (("response",) if respond else ()):
                    same(getattr(mine, name), getattr(theirs, name))
                for k in range(4):
                    same(mine.constraints[k], theirs.constraints[k])
            new = inputs._replace(force=30.0, lateral=-0.1, base=(*inputs.base[:2], 0.9))
            found = [e.with_inputs(y, theirs.acceleration, theirs.response, inputs, new) for e in (kernels, plain)]
            for k in range(2):
                same(found[0][k], found[1][k])
            history = History(1e-3, theirs.rates + 0.3, theirs.rates - 0.2)
            steps = [e.continued(y, theirs.rates, history, inputs, new, 1e-3) for e in (kernels, plain)]
            for name in ("y", "middle", "error"):
                same(getattr(steps[0], name), getattr(steps[1], name))
            same(steps[0].last.rates, steps[1].last.rates)
        same(kernels.strip_ends(y), plain.strip_ends(y))


def test_kernels_see_what_has_strayed(both):
    mechanism, y, plain, kernels = both
    values = plain.evaluate(y.copy(), Inputs()).constraints
    assert not kernels.has_strayed(y, values)
    assert not plain.has_strayed(y, values)
    longer, n = y.copy(), mechanism.count
    longer[3 * n + 4] += 1e-8
    cases = [(longer, values)]
    for name, size in (("violation", 6e-9), ("rate", 6e-8), ("rate", np.nan)):
        off = getattr(values, name).copy()
        off[5] = size
        cases.append((y, values._replace(**{name: off})))
    for state, found in cases:
        assert kernels.has_strayed(state, found)
        assert plain.has_strayed(state, found)


def test_every_kind_of_force_is_compared():
    seen = {type(f) for made, _, _ in CASES.values() for f in made().forces}
    assert seen == set(KNOWN) == set(mechanism_tables.COMPILED)


def test_what_python_calls_is_made_for_python():
    """A kernel that is compiled for other kernels alone ends the process if Python calls it."""
    multibody = Path(compiled_equations_module.__file__).parents[1]
    called = set(re.findall(r"kernels\.(\w+)\(", (multibody / "compiled" / "compiled_equations.py").read_text()))
    kernels = (multibody / "compiled" / "mechanism_kernels.py").read_text()
    assert called == set(re.findall(r"@_compiled\ndef (\w+)\(", kernels))
    called = set(re.findall(r"self\._equations\.(\w+)\(", (multibody / "reduced" / "reduced_motion.py").read_text()))
    (listed,) = re.findall(r"_FOR_PYTHON = \((.+)\)", (multibody / "reduced" / "reduced_kernels.py").read_text())
    assert called == set(re.findall(r"\w+", listed))


def test_a_kind_that_no_kernel_knows_stays_plain(both, monkeypatch):
    mechanism, y, _, _ = both
    kind = type(mechanism.definition.forces[0])
    monkeypatch.setattr(mechanism_tables, "COMPILED", frozenset(mechanism_tables.COMPILED) - {kind})
    assert compiled_equations(mechanism, y) is None
    part = MultibodyPantographPart(replace(mechanism.definition, formulation="general"))
    monkeypatch.setattr(
        part, "_built", type("Built", (), {"mechanism": mechanism, "form": "general form", "reduced": None})
    )
    assert part.form().endswith(f"; without kernels, which know no {kind.__name__}")


def test_a_run_takes_the_same_way(numba, monkeypatch):
    """From the reduced form on, when the roof begins to roll, through a jump of the lift and of the train's speed."""
    given = replace(load_pantograph("generic_multibody"), raise_start=0.0117, raise_duration=0.0)
    ways = []
    for kernel in ("numpy", "numba"):
        monkeypatch.setenv(SWITCH, kernel)
        part = MultibodyPantographPart(given)
        part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
        strips = []
        for k in range(60):
            t = 1e-3 * k
            sway = (0.0, 0.0, 0.02 * np.sin(9.0 * t), 0.18 * np.cos(9.0 * t), 0.0, 0.0)
            point = np.array([part.strip[0, 0, 0], 0.2 * np.sin(5.0 * t), 5.0])
            part.step(90.0 + 30.0 * np.sin(20.0 * t), point, np.zeros(2), 1e-3, Drive(sway=sway) if k > 9 else Drive())
            strips.append(part.strip.copy())
            if k == 40:  # what was kept goes on to the bit
                kept = part.snapshot()
        end, seen = part.strip.copy(), part.observation_values()
        part.restore(kept)
        for k in range(41, 60):
            t = 1e-3 * k
            sway = (0.0, 0.0, 0.02 * np.sin(9.0 * t), 0.18 * np.cos(9.0 * t), 0.0, 0.0)
            point = np.array([part.strip[0, 0, 0], 0.2 * np.sin(5.0 * t), 5.0])
            part.step(90.0 + 30.0 * np.sin(20.0 * t), point, np.zeros(2), 1e-3, Drive(sway=sway))
        assert part.strip.tobytes() == end.tobytes()
        assert part.observation_values().tobytes() == seen.tobytes()
        ways.append(np.array(strips))
    assert np.abs(ways[0] - ways[1]).max() < 1e-10


def test_a_wrong_switch_is_told(monkeypatch):
    monkeypatch.setenv(SWITCH, "cuda")
    part = MultibodyPantographPart(replace(load_pantograph("CX_multibody"), formulation="general"))
    with pytest.raises(KernelError, match="OPENPANTO_KERNEL is 'cuda'"):
        part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
