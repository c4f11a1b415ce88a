"""Recovering lumped models from their own frequency responses."""

import numpy as np
import pytest

from models.definition_files.toml_reader import DefinitionError
from models.pantograph.identification import Response, identify, read_response
from models.pantograph.lumped.lumped_rig import chain_stiffness

CX = (np.array([5.58, 8.78, 7.75]), np.array([108.39, 0.009, 45.85]), np.array([178.45, 15487.0, 7000.0]))
FREQUENCY = np.linspace(0.2, 20.0, 120)


def noisy(level, model=CX):
    random = np.random.default_rng(7)
    error = random.standard_normal(len(FREQUENCY)) + 1j * random.standard_normal(len(FREQUENCY))
    return chain_stiffness(FREQUENCY, *model) * (1.0 + level * error)


def matrix_stiffness(frequency, masses, dampings, stiffnesses):
    def chain(v):
        a, b, c = v
        return np.array([[a + b, -b, 0.0], [-b, b + c, -c], [0.0, -c, c]])

    s = 2j * np.pi * frequency
    return 1.0 / np.linalg.inv(chain(stiffnesses) + s * chain(dampings) + s**2 * np.diag(masses))[2, 2]


def test_chain_stiffness_is_that_of_the_matrices():
    for f in (0.0, 0.5, 3.0, 17.0):
        assert chain_stiffness(np.array([f]), *CX)[0] == pytest.approx(matrix_stiffness(f, *CX))


def test_exact_response_gives_the_model_back():
    found = identify(Response(FREQUENCY, noisy(0.0)))
    np.testing.assert_allclose(found.masses, CX[0], rtol=1e-6)
    np.testing.assert_allclose(found.stiffnesses, CX[2], rtol=1e-6)
    np.testing.assert_allclose(found.dampings, CX[1], rtol=1e-4)


def test_noisy_response_gives_the_model_back_within_its_stated_uncertainty():
    found = identify(Response(FREQUENCY, noisy(0.02)))
    np.testing.assert_allclose(found.masses, CX[0], rtol=0.05)
    np.testing.assert_allclose(found.stiffnesses, CX[2], rtol=0.05)
    np.testing.assert_allclose(found.dampings[[0, 2]], CX[1][[0, 2]], rtol=0.05)
    assert found.dampings[1] < 2.0
    assert found.misfit == pytest.approx(0.02 * np.sqrt(2.0), rel=0.15)
    for letter, values, true in (("m", found.masses, CX[0]), ("k", found.stiffnesses, CX[2])):
        for stage in range(3):
            assert abs(values[stage] - true[stage]) < 4.0 * found.deviations[f"{letter}{stage + 1}"]


def test_known_top_stage_is_kept():
    found = identify(Response(FREQUENCY, noisy(0.02)), fixed={"m3": 7.75, "k3": 7000.0, "c3": 45.85})
    assert found.masses[2] == pytest.approx(7.75)
    assert found.masses[0] == pytest.approx(5.58, rel=0.05)
    assert "m3" not in found.deviations


@pytest.mark.parametrize("kind", ["receptance", "apparent_mass", "dynamic_stiffness"])
def test_file_of_each_kind(tmp_path, kind):
    D = noisy(0.0)
    values = {
        "receptance": 1.0 / D,
        "apparent_mass": -D / (2 * np.pi * FREQUENCY) ** 2,
        "dynamic_stiffness": D,
    }[kind]
    path = tmp_path / "response.csv"
    rows = [f"{f!r},{v.real!r},{v.imag!r}" for f, v in zip(FREQUENCY.tolist(), values.tolist(), strict=True)]
    path.write_text("# measured\nfrequency,real,imaginary\n" + "\n".join(rows) + "\n")
    response = read_response(path, kind)
    np.testing.assert_allclose(response.stiffness, D, rtol=1e-12)


def test_mistakes_in_the_file_are_reported_with_their_lines(tmp_path):
    path = tmp_path / "response.csv"
    path.write_text("frequency,real,imaginary\n1.0,2.0,3.0\n-2,1,1\n3,x,1\n4,1\n")
    with pytest.raises(DefinitionError) as error:
        read_response(path)
    assert all(f"line {n}" in str(error.value) for n in (3, 4, 5))
    with pytest.raises(DefinitionError, match="cannot be read"):
        read_response(tmp_path / "none.csv")


def test_wrong_requests_are_refused():
    with pytest.raises(ValueError, match="m7"):
        identify(Response(FREQUENCY, noisy(0.0)), fixed={"m7": 1.0})
    with pytest.raises(ValueError, match="too few"):
        identify(Response(FREQUENCY[:3], noisy(0.0)[:3]))


def test_a_reference_that_follows_gives_its_time_constant_back():
    stiffness = chain_stiffness(FREQUENCY, *CX, 0.5)
    found = identify(Response(FREQUENCY, stiffness), following=True)
    assert found.reference_time == pytest.approx(0.5, rel=1e-3)
    np.testing.assert_allclose(found.stiffnesses, CX[2], rtol=1e-3)
    head = {"m3": CX[0][2], "c3": CX[1][2], "k3": CX[2][2]}
    held = identify(Response(FREQUENCY, stiffness), fixed={"T": 0.5} | head, following=True)
    assert held.reference_time == 0.5
    assert "T" not in held.deviations
    with pytest.raises(ValueError, match="there is no value T to fix"):
        identify(Response(FREQUENCY, stiffness), fixed={"T": 0.5})
