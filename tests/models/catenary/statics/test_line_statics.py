"""Static analysis against closed forms and published figures, and its command."""

import csv
import math

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from models.catenary.definition.line_definition import Wire
from models.catenary.line_model import CatenaryModel
from models.catenary.statics import elasticity, rest_profile, wire_waves
from models.commands.physics_main import main
from models.library.catalogue import line_names, load_line
from tests.effort import some
from tests.models.nodal_line import NodalLine


@pytest.fixture(scope="module")
def short(line_maker):
    return CatenaryModel(line_maker(spans=6))


@pytest.fixture(scope="module")
def re330():
    return CatenaryModel(load_line("Re330"))


def test_wave_speed_of_a_string_and_of_a_beam():
    wire = Wire(area=150e-6, mass=1.25, youngs_modulus=1.0, tension=20000.0, bending_stiffness=0.0)
    assert wire_waves.wave_speed(wire, 50.0) == pytest.approx(math.sqrt(16000.0))
    beam = Wire(area=150e-6, mass=1.25, youngs_modulus=1.0, tension=1e-9, bending_stiffness=200.0)
    assert wire_waves.wave_speed(beam, 2.0) == pytest.approx(math.pi / 2.0 * math.sqrt(200.0 / 1.25))


@pytest.mark.parametrize(
    ("name", "speed"), [("LN6", 503.0), ("LN2", 441.0), ("Re330", 572.0), ("C270", 441.0), ("Shinkansen", 521.0)]
)
def test_wave_speeds_of_table_2_1(name, speed):
    line = load_line(name)
    length = line.sections[0].spans[5].length
    assert 3.6 * wire_waves.wave_speed(line.contact_wire, length) == pytest.approx(speed, rel=0.01)


def test_reflection_doppler_and_amplification():
    equal = Wire(area=1e-4, mass=1.0, youngs_modulus=1e11, tension=20000.0)
    assert wire_waves.reflection_factor(equal, equal) == 0.5
    waves = wire_waves.waves(load_line("LN2"), 300.0 / 3.6, 50.0)
    C, V = waves.speed, 300.0 / 3.6
    r = math.sqrt(14000.0 * 0.605) / (math.sqrt(14000.0 * 0.605) + math.sqrt(20000.0 * 1.334))
    assert waves.reflection == pytest.approx(r)
    assert waves.doppler == pytest.approx((C - V) / (C + V))
    assert waves.amplification == pytest.approx(r * (C + V) / (C - V))
    assert waves.limit == pytest.approx(0.7 * C)
    assert wire_waves.waves(load_line("LN2"), 130.0, 50.0).amplification == math.inf


def test_the_largest_offset_is_sought_between_the_supports():
    x = np.arange(0.0, 60.0, 10.0)
    wire = rest_profile.Profile("contact_wire", x, np.array([-0.9, 0.2, 0.3, -0.4, 0.2, 0.8]), np.full(6, 5.0))
    assert rest_profile.largest_offset(wire, np.array([10.0, 25.0, 40.0])) == (30.0, -0.4)
    assert rest_profile.largest_offset(wire, np.array([])) == (0.0, -0.9)


def test_droppers_of_a_compound_line_reflect_at_the_auxiliary_wire():
    line = load_line("Shinkansen")
    expected = wire_waves.reflection_factor(line.auxiliary_wire, line.contact_wire)
    assert wire_waves.waves(line, 80.0, 50.0).reflection == expected


def string_on_springs(x, F1, F2, k, positions, length):
    """Return the compliance at ``x`` of a string with tension F1 tied by springs to a second string with tension F2."""

    def green(F, a, b):
        return min(a, b) * (length - max(a, b)) / (F * length)

    G1 = np.array([[green(F1, a, b) for b in positions] for a in positions])
    G2 = np.array([[green(F2, a, b) for b in positions] for a in positions])
    g = np.array([green(F1, a, x) for a in positions])
    return green(F1, x, x) - g @ np.linalg.solve(G1 + G2 + np.diag(1.0 / k), g)


@pytest.mark.parametrize("share", [0.5, 0.3975])  # nodes: a kink within an element is not resolved
def test_elasticity_of_two_strings_tied_by_springs(line_maker, share):
    """One span of wires that neither bend nor, as sagging cables would, resist by their stretch; no slack, no N/L."""
    line = line_maker(
        spans=1,
        steady_arm=None,
        ends={"rise": [0.0, "m", "test"]},
        stagger={"amplitude": [0.0, "m", "test"]},
        mesh={"elements_between_droppers": 24},
    )
    wires = ("contact_wire", "messenger_wire")
    limp = {f"{w}.bending_stiffness": 0.0 for w in wires} | {f"{w}.youngs_modulus": 1e7 for w in wires}
    line = line.with_values(limp | {"contact_wire.tension": 18000.0, "dynamics.geometric_stiffness": 0})
    model = CatenaryModel(line)
    found = elasticity.elasticity(model, np.array([50.0 * share]), 1.0)
    k = model.dropper_law.stiffness
    expected = string_on_springs(50.0 * share, 18000.0, 14000.0, k, line.sections[0].spans[0].droppers, 50.0)
    assert found.value[0] == pytest.approx(expected, rel=2e-3)


def test_elasticity_without_slack_does_not_depend_on_the_force(short):
    x = np.array([125.0, 130.0])
    small, large = (elasticity.elasticity(short, x, force).value for force in (1.0, 10.0))
    assert small == pytest.approx(large, rel=1e-9)


def test_slack_droppers_make_a_line_softer_and_the_solution_exact(short):
    """Where droppers are slack they carry nothing: removing them gives the same uplift."""
    x, force = 125.0, 400.0
    slack = elasticity.elasticity(short, np.array([x]), force)
    tight = elasticity.elasticity(short, np.array([x]), 1.0)
    assert slack.value[0] > 1.05 * tight.value[0]

    elastic = np.ones(len(short.static.dropper_force), dtype=bool)
    nodal = NodalLine(short)
    row, _ = nodal.row(0, *short.wires[0].locate(x))
    k = short.dropper_law.stiffness
    while True:
        K = nodal.K - nodal.B.T @ sp.diags(np.where(elastic, 0.0, k)) @ nodal.B
        gone = nodal.B[~elastic].T @ short.static.dropper_force[~elastic]
        d = spsolve(K.tocsc(), force * row + gone)
        tension = short.static.dropper_force + k * (nodal.B @ d)
        if np.array_equal(tension > 0.0, elastic):
            break
        elastic = tension > 0.0
    assert (~elastic).sum() >= 1
    assert force * slack.value[0] == pytest.approx(row @ d, rel=1e-8)


def test_elasticity_is_even_in_a_stitched_line_and_uneven_in_a_simple_one(re330):
    ln2 = CatenaryModel(load_line("LN2"))
    u = {}
    for name, model, number in (("LN2", ln2, 11), ("Re330", re330, 8)):
        x = elasticity.positions_in_span(model.definition.sections[0].spans[number], 2)
        u[name] = elasticity.elasticity(model, x, 100.0).non_uniformity
    assert u["Re330"] < 0.2 < 0.3 < u["LN2"]


def test_non_uniformity():
    result = elasticity.Elasticity(np.arange(3.0), np.array([2e-4, 4e-4, 6e-4]), 100.0)
    assert (result.minimum, result.maximum) == (2e-4, 6e-4)
    assert result.non_uniformity == pytest.approx(0.5)


def test_steady_arms_balance_the_kink_of_the_wire_in_plan(re330):
    """Lateral load = F (sin of the angle on one side + on the other): 2 x 27 kN x 0.6 m / 65 m = 498 N."""
    arms = rest_profile.arm_loads(re330)
    inner = (arms.x > 300.0) & (arms.x < 800.0)
    assert arms.lateral[inner] == pytest.approx(np.full(inner.sum(), 2 * 27000.0 * 0.6 / 65.0), rel=0.03)
    assert arms.lift == pytest.approx(arms.lateral * math.tan(math.radians(6.0)), rel=1e-3)


def test_the_sign_of_the_arms_angle_decides_between_lift_and_pull(re330):
    line = re330.definition.with_values({"steady_arm.angle": math.radians(6.0)})
    risen = rest_profile.arm_loads(CatenaryModel(line))
    assert (risen.lift < -30.0).all()
    assert (rest_profile.arm_loads(re330).lift > 30.0).all()


def test_profile_and_droppers_belong_together(re330):
    contact = next(p for p in rest_profile.profiles(re330) if p.component == "contact_wire")
    droppers = rest_profile.droppers(re330, 496.0, 561.0)
    assert len(droppers.x) == 9
    assert (np.diff(droppers.x) > 0.0).all()
    z = np.interp(droppers.x, contact.x, contact.z)
    share = (droppers.x - 496.0) / 65.0
    assert z == pytest.approx(5.3 - 0.065 * 4.0 * share * (1.0 - share), abs=1e-4)


@pytest.mark.parametrize("name", some(line_names(), "LN2_overlap"))
def test_command_writes_tables_and_plots_of_every_line(name, tmp_path, capsys):
    assert main(["statics", name, "--out", str(tmp_path), "--speed", "250"]) == 0
    text = capsys.readouterr().out
    assert "non-uniformity" in text
    assert "[km/h]" in text
    for plot in ("profile", "elasticity", "droppers"):
        assert (tmp_path / f"{plot}.png").stat().st_size > 10_000
    with (tmp_path / "droppers.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(s.droppers) + len(s.hangers) for s in load_line(name).sections[0].spans)
    assert all(float(row["tension [N]"]) > 0.0 for row in rows)
    tables = {"contact_wire.csv", "messenger_wire.csv", "elasticity.csv", "steady_arms.csv", "summary.csv"}
    assert tables <= {p.name for p in tmp_path.iterdir()}
    shown = [line.split()[-2] for line in text.splitlines() if "elasticity at 100 N" in line]
    with (tmp_path / "elasticity.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {int(row["section"]) for row in rows} == set(range(1, len(load_line(name).sections) + 1))
    values = [float(row["elasticity [mm/N]"]) for row in rows if row["section"] == "1"]
    assert shown == [f"{min(values):.4f}", f"{max(values):.4f}"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["LN2", "--span", "25"], "spans 1 to 24"),
        (["LN2", "--section", "2"], "sections 1 to 1"),
        (["LN2", "--set", "line.contact_wire.tension=-1"], "contact_wire.tension"),
        (["LN9"], "LN9"),
    ],
)
def test_wrong_input_is_told_on_one_line(arguments, message, capsys):
    assert main(["statics", *arguments]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
