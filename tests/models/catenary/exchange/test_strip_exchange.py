"""The exchange of a line: compiled and to be read the same to the last bit, and continued from a saved state."""

import numpy as np
import pytest

from models.catenary.exchange.strip_exchange import CompiledExchange, StripExchange, make_exchange, output_count
from models.catenary.line_state import ContactResult
from models.numerics.kernel_cache import SWITCH, KernelError

STEP = 1e-3


def strips(n, lead=0.0, pantographs=3):
    """Return strips that run along the track at different speeds and swing, shape (P, 2, 2, 3)."""
    t, result = (n + lead) * STEP, np.zeros((pantographs, 2, 2, 3))
    for p in range(pantographs):
        for side in range(2):
            phase = 3.0 * p + side
            place = [100.0 * p + 80.0 * t, 0.7 - 1.4 * side, 5.0 + 0.01 * np.sin(40.0 * t + phase)]
            result[p, side] = place, [80.0, 0.0, 0.4 * np.cos(40.0 * t + phase)]
    return result


def exchange(kind, order=2, pantographs=3):
    if kind == "plain":
        return StripExchange(pantographs, order)
    pytest.importorskip("numba")
    found = make_exchange(pantographs, order)
    assert isinstance(found, CompiledExchange)
    return found


@pytest.mark.parametrize("lead", [0.0, 1.0])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_kernels_continue_strips_to_the_last_bit(order, lead):
    """Also values valid at the end of the step, which the kernels have to recognise for themselves."""
    plain, compiled = exchange("plain", order), exchange("compiled", order)
    for one in (plain, compiled):
        one.start(0.0, strips(0))
    first, second = np.zeros((3, 2, 2, 3)), np.zeros((3, 2, 2, 3))
    for n in range(6):
        for one, out in ((plain, first), (compiled, second)):
            one.receive(n * STEP, STEP, strips(n, lead), (n + 0.4) * STEP, out)
        assert first.tobytes() == second.tobytes()
        for one, out in ((plain, first), (compiled, second)):
            one.at((n + 1.0) * STEP, out)
        assert first.tobytes() == second.tobytes()
    if order == 2:  # a quarter of a swing is a parabola to 1e-6 m
        assert first == pytest.approx(strips(6), abs=2e-3)
        assert first[:, :, 0] == pytest.approx(strips(6)[:, :, 0], abs=1e-6)


@pytest.mark.parametrize("kind", ["plain", "compiled"])
def test_a_saved_state_continues_in_either(kind):
    before = exchange(kind)
    before.start(0.0, strips(0))
    out, again = np.zeros((3, 2, 2, 3)), np.zeros((3, 2, 2, 3))
    for n in range(3):
        before.receive(n * STEP, STEP, strips(n), (n + 1) * STEP, out)
    snapshot = before.snapshot()
    before.receive(3 * STEP, STEP, strips(3), 4 * STEP, out)
    for other in ("plain", "compiled"):
        after = exchange(other)
        after.restore(snapshot)
        after.receive(3 * STEP, STEP, strips(3), 4 * STEP, again)
        assert again.tobytes() == out.tobytes()


@pytest.mark.parametrize("sections", [1, 2, 3])
def test_kernels_hand_out_resultants_to_the_last_bit(sections):
    """Forces on several wires, on one, on none: with a wire that is crossed and without."""
    rng, pantographs, supports = np.random.default_rng(5), 4, 7
    force = 100.0 * rng.random((pantographs, sections))
    point = rng.random((pantographs, sections, 3))
    force[1, 0], force[2:] = 0.0, 0.0
    point[3] = np.nan
    attached, places = rng.random((2, 30)), rng.permutation(30)[:supports]
    given = ContactResult(force, point), rng.random((pantographs, 2, 2, 3)), attached, places
    outputs = [np.full(output_count(pantographs, sections, supports), -1.0) for _ in range(2)]
    exchange("plain", 2, pantographs).publish(*given, outputs[0])
    exchange("compiled", 2, pantographs).publish(*given, outputs[1])
    assert outputs[0].tobytes() == outputs[1].tobytes()
    assert outputs[0][:pantographs] == pytest.approx(force.sum(axis=1))
    assert outputs[0][-supports:].tolist() == attached[0, places].tolist()
    assert outputs[0][4 + 9 : 4 + 12] == pytest.approx(given[1][3, :, 0].mean(axis=0))
    if sections > 1:
        assert outputs[0][16:-supports].tolist() == force.ravel().tolist()


def test_the_environment_chooses(monkeypatch):
    monkeypatch.setenv(SWITCH, "numpy")
    assert type(make_exchange(1, 2)) is StripExchange
    monkeypatch.setenv(SWITCH, "fortran")
    with pytest.raises(KernelError, match="'fortran'; use auto, numpy or numba"):
        make_exchange(1, 2)
