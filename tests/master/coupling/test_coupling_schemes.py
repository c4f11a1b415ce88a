"""Coupling schemes on an oscillator split in two, against its analytic solution."""

import numpy as np
import pytest

from master.coupling.coupling_schemes import GaussSeidel, Iterative, Jacobi, initialise, make_algorithm
from master.coupling.network import Network
from master.errors import RunError
from master.ssp.run_settings import Coupling
from master.ssp.ssp_units import Conversion
from master.system.connections import Connection

OMEGA = 2.0


def oscillator(fake_slave):
    """x' = v and v' = -omega^2 x in two slaves that hold their inputs and are exact for them."""
    position = fake_slave("position", ("v",), ("x",), np.array([1.0]), lambda s, u, t, h: s + h * u, lambda s, u: s)
    velocity = fake_slave(
        "velocity", ("x",), ("v",), np.array([0.0]), lambda s, u, t, h: s - OMEGA**2 * h * u, lambda s, u: s
    )
    return Network(
        [position, velocity],
        [Connection("velocity", "v", "position", "v"), Connection("position", "x", "velocity", "x")],
    )


def final_error(fake_slave, algorithm, count, stop=1.0):
    network = oscillator(fake_slave)
    initialise(network, 0.0, stop)
    h = stop / count
    for n in range(count):
        algorithm.step(network, n * h, h)
    exact = [np.cos(OMEGA * stop), -OMEGA * np.sin(OMEGA * stop)]
    return float(np.abs(network.outputs - exact).max())


@pytest.mark.parametrize(
    ("make", "order"),
    [
        (Jacobi, 1),
        (GaussSeidel, 1),
        (lambda: Iterative(1e-13), 1),
        (lambda: Iterative(1e-13, weight=0.5), 2),
    ],
    ids=["jacobi", "gauss-seidel", "iterative-end", "iterative-mean"],
)
def test_observed_order(fake_slave, make, order):
    errors = [final_error(fake_slave, make(), n) for n in (50, 100, 200, 400)]
    observed = np.log2(np.array(errors[:-1]) / errors[1:])
    assert observed == pytest.approx(order, abs=0.12)


def test_gauss_seidel_keeps_energy_where_jacobi_adds_it(fake_slave):
    """Jacobi is explicit Euler here (|amplification| > 1), Gauss-Seidel symplectic Euler (= 1)."""
    energies = {}
    for algorithm in (Jacobi(), GaussSeidel()):
        network = oscillator(fake_slave)
        initialise(network, 0.0, 100.0)
        for n in range(10000):
            algorithm.step(network, n * 0.01, 0.01)
        x, v = network.outputs
        energies[algorithm.name] = 0.5 * v**2 + 0.5 * OMEGA**2 * x**2
    start = 0.5 * OMEGA**2
    assert energies["jacobi"] / start == pytest.approx((1 + (OMEGA * 0.01) ** 2) ** 10000, rel=1e-6)
    assert energies["gauss-seidel"] / start == pytest.approx(1.0, abs=0.03)


def test_gauss_seidel_order_of_slaves_matters_and_is_honoured(fake_slave):
    network = oscillator(fake_slave)
    initialise(network, 0.0, 1.0)
    GaussSeidel(["velocity", "position"]).step(network, 0.0, 0.1)
    # the velocity steps first with the old position; the position then uses the new velocity
    assert network.outputs[1] == pytest.approx(-0.1 * OMEGA**2)
    assert network.outputs[0] == pytest.approx(1.0 - 0.1 * 0.1 * OMEGA**2)


def test_after_a_step_the_inputs_are_what_the_slaves_were_told(fake_slave):
    """Also what the first of three received, though its source, the second, has stepped before the third does."""
    slaves = [
        fake_slave(f"s{i}", ("u",), ("y",), np.array([float(i + 1)]), lambda s, u, t, h: s + h * u, lambda s, u: s)
        for i in range(3)
    ]
    network = Network(slaves, [Connection(f"s{(i + 1) % 3}", "y", f"s{i}", "u") for i in range(3)])
    initialise(network, 0.0, 1.0)
    GaussSeidel().step(network, 0.0, 0.5)
    first = 1.0 + 0.5 * 2.0
    assert network.inputs.tolist() == [2.0, 3.0, first]
    assert network.outputs.tolist() == [first, 2.0 + 0.5 * 3.0, 3.0 + 0.5 * first]


def test_slaves_may_start_at_times_of_their_own(fake_slave, monkeypatch):
    seen = {}
    monkeypatch.setattr(fake_slave, "start", lambda slave, start, stop: seen.update({slave.name: (start, stop)}))
    initialise(oscillator(fake_slave), 1.0, 5.0, {"velocity": 3.0})
    assert seen == {"position": (1.0, 5.0), "velocity": (3.0, 5.0)}


def test_jacobi_does_not_depend_on_the_order_of_slaves(fake_slave):
    a = oscillator(fake_slave)
    b = Network(
        list(reversed(oscillator(fake_slave).slaves)),
        [Connection("velocity", "v", "position", "v"), Connection("position", "x", "velocity", "x")],
    )
    for network in (a, b):
        initialise(network, 0.0, 1.0)
        for n in range(20):
            Jacobi().step(network, 0.05 * n, 0.05)
    assert a.outputs.tolist() == b.outputs[::-1].tolist()


def test_iterative_ends_where_its_own_equation_holds(fake_slave):
    """With weight 1/2 the step is the trapezoidal rule: check its equation, not a stored number."""
    network = oscillator(fake_slave)
    initialise(network, 0.0, 1.0)
    x0, v0 = network.outputs
    Iterative(1e-14, weight=0.5).step(network, 0.0, 0.1)
    x1, v1 = network.outputs
    assert x1 - x0 == pytest.approx(0.05 * (v0 + v1), abs=1e-13)
    assert v1 - v0 == pytest.approx(-0.05 * OMEGA**2 * (x0 + x1), abs=1e-13)


def test_iterative_releases_every_state_it_saves_also_on_failure(fake_slave):
    network = oscillator(fake_slave)
    initialise(network, 0.0, 1.0)
    with pytest.raises(RunError, match=r"still changes by .* after 3 repetitions"):
        Iterative(1e-15, max_iterations=3).step(network, 0.0, 0.4)
    for slave in network.slaves:
        assert slave.calls.count("save") == slave.calls.count("release") == 1


def _settling(fake_slave):
    """An oscillation that has been large and is dying out, iterated to a share of how large it has been."""
    network = oscillator(fake_slave)
    initialise(network, 0.0, 1.0)
    scheme = Iterative(1e-3)
    for n in range(5):
        scheme.step(network, 0.02 * n, 0.02)
    for slave in network.slaves:
        slave.state = 1e-4 * slave.state
    network.read()
    return network, scheme


def test_an_iterative_scheme_that_recalls_its_memory_repeats_as_often_as_one_that_was_not_interrupted(fake_slave):
    """What counts as settled is relative to the largest values so far, so it has to come along."""
    (network, scheme), (other, before) = _settling(fake_slave), _settling(fake_slave)
    resumed, forgetful = Iterative(1e-3), Iterative(1e-3)
    resumed.restore(before.save())
    started = scheme.iterations
    for each, net in ((scheme, network), (resumed, other)):
        for n in range(5, 10):
            each.step(net, 0.02 * n, 0.02)
    assert resumed.iterations == scheme.iterations - started
    assert other.outputs.tolist() == network.outputs.tolist()
    assert resumed.save().tolist() == scheme.save().tolist()
    third, _ = _settling(fake_slave)
    for n in range(5, 10):
        forgetful.step(third, 0.02 * n, 0.02)
    assert forgetful.iterations > resumed.iterations  # so that the above is not so by itself


def test_memory_that_is_handed_out_is_not_changed_by_further_steps(fake_slave):
    network, scheme = _settling(fake_slave)
    taken = scheme.save()
    kept = taken.copy()
    for slave in network.slaves:
        slave.state = 1e6 * slave.state
    scheme.step(network, 0.1, 0.02)
    assert taken.tolist() == kept.tolist()
    assert scheme.save().max() > 10.0 * kept.max()


def test_wires_convert(fake_slave):
    source = fake_slave("a", (), ("y",), np.array([36.0]), lambda s, u, t, h: s)
    sink = fake_slave("b", ("u",), (), np.zeros(1), lambda s, u, t, h: s, lambda s, u: u[:0])
    network = Network([source, sink], [Connection("a", "y", "b", "u", Conversion(1 / 3.6, 2.0))])
    initialise(network, 0.0, 1.0)
    assert network.inputs[0] == pytest.approx(12.0)
    network.inputs[:] = 0.0
    network.gather_for(1)
    assert network.inputs[0] == pytest.approx(12.0)


def test_network_refuses_an_unconnected_input(fake_slave):
    slave = fake_slave("b", ("u",), (), np.zeros(1), lambda s, u, t, h: s)
    with pytest.raises(RunError, match=r"'b\.u' is not connected"):
        Network([slave], [])


def chain(fake_slave, gains):
    """Slaves with feedthrough u -> gain u + 1, in a ring."""
    slaves = [
        fake_slave(f"s{i}", ("u",), ("y",), np.zeros(1), lambda s, u, t, h: s, lambda s, u, g=g: g * u + 1.0)
        for i, g in enumerate(gains)
    ]
    n = len(gains)
    return Network(slaves, [Connection(f"s{(i - 1) % n}", "y", f"s{i}", "u") for i in range(n)])


def test_initialisation_exchanges_until_consistent(fake_slave):
    network = chain(fake_slave, [0.5, -0.25, 0.1])
    initialise(network, 0.0, 1.0)
    y = network.outputs
    expected = [0.5 * y[2] + 1.0, -0.25 * y[0] + 1.0, 0.1 * y[1] + 1.0]
    assert y == pytest.approx(expected, abs=1e-9)
    assert [s.calls for s in network.slaves] == [["start", "finish"]] * 3


def test_initialisation_that_contradicts_itself_is_refused(fake_slave):
    with pytest.raises(RunError, match=r"initialization: 's\d\.y' still changes"):
        initialise(chain(fake_slave, [1.0, 1.0]), 0.0, 1.0)


def test_make_algorithm_passes_the_settings_on(fake_slave):
    settings = Coupling.model_validate({"scheme": "iterative", "tolerance": 1e-15, "maxIterations": 3})
    network = oscillator(fake_slave)
    initialise(network, 0.0, 1.0)
    with pytest.raises(RunError, match="after 3 repetitions"):
        make_algorithm(settings).step(network, 0.0, 0.4)
    assert make_algorithm(Coupling.model_validate({})).name == "jacobi"
