"""A pantograph on a wavy running surface of a line that does not move, against its receptance."""

from collections import namedtuple

import numpy as np
import pytest

from models.catenary.definition.line_reading import load
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.commands.physics_main import main
from models.coupled.monolithic import CoupledModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from tests.models.rigid_line import SPEED, STIFFNESS, amplitude, expected_amplitude, pressing, write_rigid_line

#: Waves and heights, the amplitudes printed for them [N], and rings and runs that show them.
Wave = namedtuple("Wave", "length height printed ring run periods")
SHORT = Wave(2.0, 0.5e-3, 10.40, 14, 1.5, 12)
MIDDLE = Wave(6.75, 2e-3, 78.80, 54, 1.2, 4)
LONG = Wave(50.0, 5e-3, 14.93, 50, 2.4, 1)

#: Steps, each half of that before [s], and how many of them make the first.
STEPS = ((2e-3, 1), (1e-3, 2), (5e-4, 4))


@pytest.fixture
def line_of(tmp_path):
    return lambda wave: load(write_rigid_line(tmp_path, wave.ring, wave.length, wave.height))


def _monolithic(line, pantograph, wave, step):
    force = CoupledModel(CatenaryModel(line), [pantograph]).run(wave.run, step).contact_force[:, 0]
    assert force[-300:].min() > 100.0  # it stays closed
    return amplitude(force, step, wave.length, wave.periods)


def _monolithic(line, pantograph, run, step):
    """Return the contact force of one system [N]."""
    return CoupledModel(CatenaryModel(line), [pantograph]).run(run, step).contact_force[:, 0]


@pytest.mark.parametrize("wave", [SHORT, MIDDLE, LONG], ids=["2 m", "6.75 m", "50 m"])
def test_what_is_expected_is_what_is_printed(cx, wave):
    assert expected_amplitude(pressing(cx), wave.length, wave.height) == pytest.approx(wave.printed, rel=5e-4)


@pytest.mark.parametrize(("wave", "step"), [(SHORT, 1e-3), (LONG, 4e-3)], ids=["2 m", "50 m"])
def test_one_system_makes_the_printed_amplitudes(line_of, cx, wave, step):
    """The wave of 6.75 m: `test_the_command_makes_it_too`."""
    force = _monolithic(line_of(wave), pressing(cx), wave.run, step)
    assert force[len(force) // 2 :].min() > 100.0  # it stays closed
    assert amplitude(force, step, wave.length, wave.periods) == pytest.approx(wave.printed, rel=5e-3)


def test_the_error_falls_with_the_square_of_the_step(line_of, cx):
    line, pantograph = line_of(SHORT), pressing(cx)
    coarse, middle, fine = (_monolithic(line, pantograph, 0.3, h)[round(0.1 / h) :: k] for h, k in STEPS)
    assert np.abs(middle - coarse).max() / np.abs(fine - middle).max() == pytest.approx(4.0, abs=0.2)


def _cosimulated(line, pantograph, wave, step, **changes):
    """Return the amplitude and both parts: each gets what the other had at the beginning of a step."""
    catenary, part = CatenaryPart(line.with_values(changes)), LumpedPantographPart(pantograph.with_values(changes))
    base, forces = np.zeros(2), []
    part.initialise(0.0, 0.0, np.zeros(3), base)
    catenary.initialise(0.0, part.strip[None])
    for _ in range(round(wave.run / step)):
        force, point, strip = catenary.contact_force[0], catenary.contact_point[0].copy(), part.strip.copy()
        catenary.step(strip[None], step)
        part.step(force, point, base, step)
        forces.append(catenary.contact_force[0])
    return amplitude(forces, step, wave.length, wave.periods), catenary, part


def test_co_simulated_parts_make_it_and_keep_their_balance(line_of, cx):
    """What the strip gives beyond what the line receives, the train gives too: its traction pushes up the surface."""
    found, catenary, part = _cosimulated(line_of(SHORT), pressing(cx), SHORT, 1e-3, monitor_energy=1)
    assert found == pytest.approx(SHORT.printed, rel=1e-2)
    passed = abs(catenary.contact_work[0]) + SHORT.run * SPEED * 250.0 * SHORT.height
    assert abs(catenary.energy[3]) < 1e-11 * passed
    assert abs(catenary.contact_work - part.contact_work)[0] < 1e-3 * passed


def test_the_train_gives_the_strip_what_the_surface_lifts_it_by(line_of, cx):
    """Work of the strip = stored in the contact + work on the line + the integral of F v dr/dx.

    Besides there is little: what the train gives up the slope that the force itself makes in the wire.
    """
    line = line_of(SHORT._replace(height=5e-3)).with_values({"monitor_energy": 1})
    catenary = CatenaryPart(line)
    surface, rows, h, rising = catenary.model.wires[0].surface, [], 2.5e-4, 0.05

    def strip(t):
        z, vz = 5.09 + rising * t, rising
        return np.array([[[[SPEED * t, y, z], [SPEED, 0.0, vz]] for y in (0.5, -0.5)]])

    catenary.initialise(0.0, strip(0.0))
    for n in range(481):
        if n:
            catenary.step(strip((n - 1) * h), h)
        x = SPEED * n * h
        force = catenary.contact_force[0]
        rows.append((force, force * SPEED * surface.slope(x), 0.5 * force**2 / STIFFNESS))
    power, stored = np.array(rows)[:, 1], np.array(rows)[:, 2]
    lifted = h * (power.sum() - 0.5 * (power[0] + power[-1]))
    received = stored[-1] - stored[0] + catenary.energy[2] + lifted
    assert lifted > 0.5
    assert catenary.contact_work[0] == pytest.approx(received, abs=2e-2 * lifted)


def test_the_command_makes_it_too(tmp_path, capsys):
    """An amplitude of a N is a root mean square of a / sqrt(2); the figures' filter lets 12 Hz pass."""
    line = write_rigid_line(tmp_path, MIDDLE.ring, MIDDLE.length, MIDDLE.height)
    own = ("static_force=250", "raise_duration=0.05", "reference_height=5.08")
    given = [word for value in own for word in ("--set", f"pantograph.{value}")]
    run = ["--speed", "300", "--start", "0", "--end", "100", "--out", str(tmp_path / "out"), "--quiet", *given]
    assert main(["couple", str(line), "CX", *run]) == 0
    table = np.genfromtxt(tmp_path / "out" / "timeseries.csv", delimiter=",", names=True)
    force, step = table["catenarypantograph1contactforce_N"], table["time_s"][1] - table["time_s"][0]
    assert amplitude(force, step, MIDDLE.length, 4) == pytest.approx(MIDDLE.printed, rel=5e-3)
    capsys.readouterr()
