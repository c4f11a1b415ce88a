"""Every registry is walked: whatever is listed does something, and no list knows what another has not heard of."""

from __future__ import annotations

import argparse
import ast
import importlib
import inspect
import re
import typing
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import openpanto
from fmus import __main__ as fmus_main
from fmus.__main__ import _parser as fmus_parser
from fmus.builder import recipe
from fmus.slave.model_description import _DERIVED
from master.batch.optimisation import optimisation_session
from master.batch.study import study_session
from master.batch.sweep import distributions, sensitivity, sweep_plan, sweep_session
from master.batch.verification import verification_session
from master.batch.verification.quantities import QUANTITIES
from master.commands import main, verb_options
from master.coupling import coupling_schemes
from master.coupling.coupling_schemes import ALGORITHMS, make_algorithm
from master.coupling.network import Network
from master.errors import RunError
from master.evaluation import filters
from master.fmu.isolation import isolated_instance
from master.report import report_files
from master.report.charts import run_charts
from master.report.run_inputs import scheme_options
from master.scenario import overrides
from master.ssp.run_settings import OPTIONS, SCHEMES, Coupling
from master.ssp.ssp_units import COMMON
from models import contact_law
from models.catenary.definition.line_definition import Contact
from models.commands import physics_main, physics_verbs
from models.contact_law import CONTACT_LAWS, ContactLawError, NormalForce, continuous_contact, register_contact_law
from models.definition_files.si_units import OFFSETS, SI, to_si
from models.definition_files.toml_reader import DefinitionError
from models.pantograph import identification
from models.pantograph.multibody.elements import joints
from models.pantograph.multibody.elements.force_elements import KNOWN, ForceElements
from models.pantograph.multibody.mechanism import Inputs, Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble
from models.pantograph.multibody.mechanism_definition import FORCES, JOINTS, Force, PairJoint
from tests.master.conftest import FakeSlave
from tests.models.pantograph.multibody.mechanisms import body, joint, mechanism_data, mechanism_from, q

ROOT = Path(__file__).parents[1]


# Coupling schemes


def test_every_scheme_is_made_as_itself_and_told_its_options():
    assert set(SCHEMES) == set(ALGORITHMS) == set(OPTIONS)
    for name in SCHEMES:
        made = make_algorithm(Coupling.model_validate({"scheme": name}))
        assert made.name == name
        taken = [p for p in inspect.signature(ALGORITHMS[name]).parameters if p not in ("args", "kwargs")]
        assert tuple(taken) == OPTIONS[name]


def test_every_setting_of_a_coupling_is_the_option_of_a_scheme():
    assert set(Coupling.model_fields) == {"scheme", *(o for options in OPTIONS.values() for o in options)}


def test_a_scheme_that_nobody_makes_is_no_other():
    with pytest.raises(RunError, match=rf"no coupling scheme 'magic' \(known: {', '.join(SCHEMES)}\)"):
        make_algorithm(Coupling.model_construct(scheme="magic"))


@pytest.mark.parametrize("name", SCHEMES)
def test_every_scheme_steps(name):
    slaves = [FakeSlave(n, (), ("y",), np.zeros(1), lambda s, u, t, h: np.array([t + h])) for n in "ab"]
    network = Network(slaves, [])
    coupling_schemes.initialise(network, 0.0, 1.0)
    make_algorithm(Coupling.model_validate({"scheme": name})).step(network, 0.0, 0.1)
    assert network.outputs.tolist() == pytest.approx([0.1, 0.1])


@pytest.mark.parametrize("name", SCHEMES)
def test_options_of_every_scheme_are_shown(name):
    coupling = Coupling.model_validate({"scheme": name, "order": ("a", "b")})
    shown = dict(scheme_options(coupling.model_dump(mode="json")))
    assert list(shown) == [o.replace("_", " ") for o in OPTIONS[name]]
    assert name != "gauss-seidel" or shown == {"order": "a b"}


# Contact laws


@pytest.mark.parametrize("name", CONTACT_LAWS)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_every_contact_law_pushes_and_has_the_slopes_it_says(name, exponent):
    law, parameters, h = CONTACT_LAWS[name], Contact(stiffness=5e4, exponent=exponent, restitution=0.8), 1e-7
    value = law(0.004, 0.1, 0.3, parameters)
    assert value.force > 0.0
    deeper, faster = law(0.004 + h, 0.1, 0.3, parameters), law(0.004, 0.1 + h, 0.3, parameters)
    assert value.by_penetration == pytest.approx((deeper.force - value.force) / h, rel=1e-3)
    assert value.by_velocity == pytest.approx((faster.force - value.force) / h, rel=1e-3)


def _jumping(d, v, impact, p):
    found = continuous_contact(d, v, impact, p)
    return found._replace(force=found.force + 10.0) if d > 0.0 else found


def _sticking(d, v, impact, p):
    return NormalForce(p.stiffness * d, p.stiffness, 0.0)


def _stepping(d, v, impact, p):
    return continuous_contact(d, v, impact, p).scaled(1.0 if v > 0.123 else 0.99)


def _early(d, v, impact, p):
    return continuous_contact(d + 0.001, v, impact, p)


def _boundless(d, v, impact, p):
    return NormalForce(1.0 / d if d > 0.0 else 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (_jumping, "jumps by 10 N at a penetration of 0: a step beside it would have no solution"),
        (_stepping, r"jumps by [\d.]+ N at a velocity of 0.123: a step beside it"),
        (_sticking, "gives -1000 N at a penetration of -0.02: not a push"),
        (_early, "at a penetration of 0 m: without contact"),
        (_boundless, "jumps by"),
    ],
)
def test_a_law_that_no_step_can_be_solved_with_is_not_registered(law, said):
    with pytest.raises(ContactLawError, match=rf"contact law 'new' .*{said}"):
        register_contact_law("new", law)
    assert "new" not in CONTACT_LAWS


def test_a_sound_law_is_registered_once(monkeypatch):
    monkeypatch.setattr(contact_law, "_laws", {})
    register_contact_law("mine", continuous_contact)
    assert contact_law._laws == {"mine": continuous_contact}
    with pytest.raises(ContactLawError, match="there is already a contact law 'mine'"):
        register_contact_law("mine", continuous_contact)


# Joints and forces of mechanisms

POINTS = {"point_i": (0.5, 0.0, 0.0), "point_j": (-0.5, 0.0, 0.0)}


@pytest.mark.parametrize("kind", sorted(set(JOINTS) - {"prescribed_motion"}))
def test_every_kind_of_joint_holds_something(kind):
    across = {"axis_i": (0.0, 1.0, 0.0), "axis_j": (0.0, 0.0, 1.0)}
    along = {"axis_i": (0.0, 1.0, 0.0), "axis_j": (0.0, 1.0, 0.0)}
    axes = across if kind in ("universal", "perpendicular", "revolute_prismatic") else along
    rod = body(2.0, (0.1, 0.2, 0.2), (1.0, 0.0, 0.0))
    data = mechanism_data({"rod": rod}, {"it": joint(kind, "base", "rod", **POINTS, **axes)})
    wanted = {"kind", *(f.name for f in fields(JOINTS[kind]))}
    data["joint"]["it"] = {k: v for k, v in data["joint"]["it"].items() if k in wanted}
    assert len(Mechanism(mechanism_from(data)).rows) >= 1


def test_kinds_of_joints_are_those_that_have_rows():
    assert set(joints.JOINT_ROWS) == {cls for cls in JOINTS.values() if issubclass(cls, PairJoint)}
    assert {kind for kind, cls in JOINTS.items() if not issubclass(cls, PairJoint)} == {"prescribed_motion"}


def test_a_kind_of_joint_without_rows_is_no_free_joint():
    with pytest.raises(DefinitionError, match="is none of"):
        mechanism_from(mechanism_data({}, {"it": joint("glued", "base", "base")}))


#: Values with which each kind of force pushes on a rod that moves.
GIVEN = {
    "spring_damper": {"stiffness": q(100.0, "N/m"), "free_length": q(0.1, "m")},
    "actuator_force": {"force": q(50.0, "N")},
    "actuator_moment": {"moment": q(50.0, "N.m"), "axis_i": q([0.0, 1.0, 0.0], "1")},
    "bump_stop": {"stiffness": q(1e4, "N/m"), "longest": q(0.01, "m")},
    "angle_stop": {"stiffness": q(1e3, "N.m/rad"), "highest": q(-0.1, "rad"), "axis_i": q([0.0, 1.0, 0.0], "1")},
    "bushing": {"translation_stiffness": q([1e3, 1e3, 1e3], "N/m"), "rotation_damping": q([1, 1, 1], "N.m.s/rad")},
    "joint_friction": {"moment": q(5.0, "N.m"), "transition": q(0.1, "rad/s"), "joint": "hinge"},
    "aerodynamic": {"body": "rod", "point": q([0.2, 0.0, 0.0], "m"), "coefficient": q(0.01, "N.s2/m2")},
}


def pushed(kind):
    """Return a rod on a hinge with one force, and the loads while it turns."""
    given = dict(GIVEN[kind])
    if kind not in ("joint_friction", "aerodynamic"):
        given |= {"body_i": "base", "body_j": "rod"}
        if kind not in ("actuator_moment", "angle_stop"):
            given |= {"point_i": q([0.0, 0.0, 0.5], "m"), "point_j": q([0.2, 0.0, 0.0], "m")}
    axes = {"axis_i": (0, 1, 0), "axis_j": (0, 1, 0)}
    hinge = joint("revolute", "base", "rod", point_i=(0, 0, 0), point_j=(-0.5, 0, 0), **axes)
    rod = body(2.0, (0.01, 0.2, 0.2), (0.5, 0.0, 0.0))
    data = mechanism_data({"rod": rod}, {"hinge": hinge}, {"it": {"kind": kind, **given}})
    mechanism = Mechanism(mechanism_from({**data, "gravity": q(0.0, "m/s2")}))
    y = assemble(mechanism)
    r, p, v, w = mechanism.split(y)
    w = w.copy()
    w[1, 1] = 0.5
    moving = mechanism.join(r, p, v, w)
    return mechanism.loads(moving, mechanism.kinematics(moving), Inputs(against=10.0))


@pytest.mark.parametrize("kind", FORCES)
def test_every_kind_of_force_pushes(kind):
    loads = pushed(kind)
    assert np.abs(loads[1]).max() > 0.1
    if kind != "aerodynamic":  # which pushes against the air
        np.testing.assert_allclose(loads[0, :3], -loads[1, :3], atol=1e-12)  # action and reaction


def leaves(cls):
    """Yield the classes of the definition that nothing is derived from."""
    below = [c for c in cls.__subclasses__() if c.__module__ == Force.__module__]
    yield from (leaf for c in below for leaf in leaves(c))
    if not below:
        yield cls


def test_kinds_of_forces_are_the_same_in_every_list():
    assert set(FORCES) == set(GIVEN)
    assert set(KNOWN) == set(leaves(Force))


def test_a_kind_of_force_that_nobody_computes_is_refused():
    class Magnet(Force):
        pass

    with pytest.raises(ValueError, match="force 'it': nothing computes a Magnet"):
        ForceElements([Magnet(name="it")], [], {}, np.zeros((0, 3, 3)), None)


# Quantities, charts, verbs, units


def test_every_quantity_measures_something_else_and_has_a_unit_that_is_known():
    titles = [quantity.title for quantity in QUANTITIES.values()]
    assert len(set(titles)) == len(titles)
    for key, quantity in QUANTITIES.items():
        assert callable(quantity.measure), key
        assert all(part in {*COMMON, ""} for part in quantity.unit.split("/")) or quantity.unit in COMMON, key


def test_quantities_and_schemes_are_documented():
    """Each has its row, or its place in one."""
    rows = [line for line in _page("verification.md").splitlines() if line.startswith("| ")]
    named = {name.strip() for row in rows for name in row.split("|")[1].split(",")}
    assert set(QUANTITIES) <= named
    assert all(f"| `{scheme}` |" in _page("theory/coupling.md") for scheme in SCHEMES)
    (row,) = [line for line in _page("scenarios.md").splitlines() if line.startswith("| Coupling | scheme |")]
    assert all(scheme in row for scheme in SCHEMES)


def _page(name):
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def test_every_chart_is_in_a_report():
    """A function of the room that makes a chart is asked by one that makes all, itself or through another."""
    room = Path(run_charts.__file__).parent
    trees = [ast.parse(p.read_text(encoding="utf-8")) for p in room.glob("*_charts.py") if p.stem != "measured_charts"]
    functions = {n.name: n for tree in trees for n in tree.body if isinstance(n, ast.FunctionDef)}
    makers = {n for n, f in functions.items() if f.returns is not None and "Chart" in ast.unparse(f.returns)}
    asked, left = set(), ["run_charts", "file_charts"]
    while left:
        asked.add(name := left.pop())
        used = {n.id for n in ast.walk(functions[name]) if isinstance(n, ast.Name)}
        left += sorted((used & set(functions)) - asked - set(left))
    assert len(makers) > 8
    assert makers <= asked


def verbs(parser):
    (action,) = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return action.choices


def test_every_verb_of_the_master_is_one_and_does_something():
    """One that is missing from `VERBS` would be taken for a scenario's name."""
    known = verbs(main._parser(main.VERBS))
    assert tuple(sorted(known)) == tuple(sorted(main.VERBS))
    assert all(callable(parser.get_default("verb")) for parser in known.values())


def test_every_verb_of_the_others_does_something():
    assert all(callable(parser.get_default("run")) for parser in verbs(fmus_parser()).values())
    parser = argparse.ArgumentParser()
    subparsers = parser.add_subparsers()
    for add in physics_main._VERBS:
        add(subparsers)
    assert all(callable(p.get_default("run")) for p in subparsers.choices.values())
    assert {p.stem for p in (ROOT / "models/commands").glob("*_command.py")} == {
        f"{v}_command" for v in subparsers.choices
    }


def test_what_carries_out_a_verb_is_there():
    """The modules that are imported when a verb is carried out, by their names."""
    called = re.findall(r'_later\("(\w+)", "(\w+)"\)', inspect.getsource(verb_options))
    assert len(called) == len(main.VERBS)
    assert all(callable(getattr(importlib.import_module(f"master.commands.{m}"), f)) for m, f in called)
    called = re.findall(r'_later\("(\w+)"\)', inspect.getsource(physics_verbs))
    assert len(called) == len(physics_main._VERBS)
    assert all(callable(importlib.import_module(f"models.commands.{m}").run) for m in called)


@pytest.mark.parametrize("name", sorted(SI))
def test_every_unit_of_a_definition_is_one_of_the_master_and_of_fmi(name):
    """The same factor on both sides of an FMU, and dimensions that its description can spell."""
    si, factor = SI[name]
    assert SI[si] == (si, 1.0)
    assert to_si(3.0, name, si) == pytest.approx(3.0 * factor + OFFSETS.get(name, 0.0))
    for part in si.replace("/", ".").split("."):
        assert part.rstrip("0123456789") in _DERIVED or part == "1"
    if name in COMMON:
        assert COMMON[name].factor == pytest.approx(factor)
        assert COMMON[name].offset == OFFSETS.get(name, 0.0)
        assert si not in COMMON or COMMON[name].dimension == COMMON[si].dimension


def test_schemes_have_their_types():
    assert typing.get_args(Coupling.model_fields["scheme"].annotation) == SCHEMES


# What the command lines write out, so that they need not import it


def test_the_choices_of_the_verbs_are_the_kinds_that_there_are():
    assert verb_options.SCHEMES == SCHEMES
    assert verb_options.FORMATS == tuple(report_files.FORMATS)
    assert typing.get_args(sweep_plan.Keep) == verb_options.KEPT
    assert typing.get_args(sweep_plan.Engine) == verb_options.ENGINES
    assert typing.get_args(distributions.Method) == verb_options.SAMPLINGS
    assert typing.get_args(sensitivity.SensitivityMethod) == verb_options.SENSITIVITIES
    assert physics_verbs.RESPONSES == identification.RESPONSE_KINDS
    assert typing.get_args(overrides.FaultsOf) == verb_options.FAULTS_OF
    assert typing.get_args(filters.Kind) == physics_verbs.FILTERS
    assert fmus_main._MAX_PORTS == recipe.MAX_PORTS


def test_the_defaults_in_the_help_are_those_that_are_taken():
    verbs = openpanto._verbs(openpanto.command_line())
    said = {name: " ".join(verb.format_help().split()) for name, verb in verbs.items()}
    default = filters.DEFAULT
    assert f"of butterworth (default {default.order})" in said["couple"]
    assert f"of butterworth (default {default.phase})" in said["couple"]
    assert verbs["couple"].get_default("cutoff") == default.cutoff
    assert verbs["couple"].get_default("filter") == default.kind
    assert f"from {filters.SETTLING:g} s after the first contact" in said["couple"]
    assert f"initialising may take, default {isolated_instance.INIT_TIMEOUT:g}" in said["run"]
    for verb, name in (
        ("study", study_session.JSON),
        ("sweep", sweep_session.JSON),
        ("optimise", optimisation_session.JSON),
        ("verify", verification_session.JSON),
    ):
        assert f"print {name}" in said[verb]
