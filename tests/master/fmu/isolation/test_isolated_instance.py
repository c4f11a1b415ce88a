"""An isolated FMU gives the values of one that is not, and its end is one sentence."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

from master.errors import SlaveError
from master.fmu.instance import Instance
from master.fmu.isolation.isolated_instance import IsolatedInstance, Isolation

ROOT = Path(__file__).parents[4]


def advance(instance, inputs, time, value):
    inputs[0] = value
    instance.write()
    instance.step(time, 0.1)
    instance.read()


def test_values_are_those_of_an_fmu_that_is_not_isolated(isolate, crasher):
    found = []
    plain = Instance(crasher(gain=0.1))
    a, b = np.zeros(1), np.zeros(1)
    plain.bind(a, b)
    plain.start(0.0, 1.0)
    plain.finish_initialisation()
    for instance, inputs, outputs in ((plain, a, b), isolate(gain=0.1)):
        group, seldom = instance.group(["double", "u"]), instance.group(["sum"])
        values = []
        for n in range(12):
            advance(instance, inputs, 0.1 * n, 1.0 / (n + 3))
            if n not in (4, 5):  # read at every step, then at none, then again
                group.read()
            if n % 3 == 0:
                seldom.read()
            values.append([*outputs.tolist(), *group.values.tolist(), *seldom.values.tolist()])
        found.append(values)
    plain.close()
    assert found[0] == found[1]
    assert found[1][-1][0] == pytest.approx(0.1 * sum(1 / (n + 3) for n in range(12)))


@pytest.mark.parametrize("period", [1, 5])
def test_what_is_read_at_intervals_comes_with_the_step(isolate, monkeypatch, period):
    """Only until the interval is known it is asked for."""
    instance, inputs, _ = isolate()
    group = instance.group(["double"])
    requests = []
    ask = instance._ask
    monkeypatch.setattr(instance, "_ask", lambda *a: (requests.append(a), ask(*a))[1])
    for n in range(1, 21):
        advance(instance, inputs, 0.1 * n, 1.0)
        if n % period == 0:
            group.read()
            assert group.values.tolist() == [2.0 * n]
    assert len(requests) == 1


def test_inputs_count_for_whatever_is_asked_next(isolate):
    instance, inputs, outputs = isolate()
    group = instance.group(["u"])
    inputs[0] = 3.0
    instance.write()
    inputs[0] = 4.0  # not written
    group.read()
    assert group.values.tolist() == [3.0]
    instance.step(0.0, 0.1)
    instance.read()
    assert outputs.tolist() == [3.0]


def test_two_runs_from_a_saved_state_are_the_same(isolate):
    instance, inputs, outputs = isolate()
    advance(instance, inputs, 0.0, 1.0)
    state, data = instance.save(), instance.serialise()
    found = []
    for again in (lambda: instance.restore(state), lambda: instance.deserialise(data), lambda: None):
        advance(instance, inputs, 0.1, 5.0)
        found.append(outputs.tolist())
        again()
        instance.read()
        found.append(outputs.tolist())
    instance.release(state)
    assert found == [[6.0], [1.0], [6.0], [1.0], [6.0], [6.0]]


def test_a_state_is_read_by_an_fmu_that_is_not_isolated(isolate, crasher):
    instance, inputs, _ = isolate()
    advance(instance, inputs, 0.0, 7.0)
    plain = Instance(crasher())
    outputs = np.zeros(1)
    plain.bind(np.zeros(1), outputs)
    plain.start(0.0, 1.0)
    plain.finish_initialisation()
    plain.deserialise(instance.serialise())
    plain.read()
    plain.close()
    assert outputs.tolist() == [7.0]


def test_components_step_at_the_same_time(isolate, tmp_path, monkeypatch):
    """No step ends before the other one has begun."""
    monkeypatch.setenv("TOY_MEETING", str(tmp_path))
    made = [isolate(deed=9)[0] for _ in range(2)]
    for instance in made:
        instance.step(0.0, 0.1)
    for instance in made:
        instance.read()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("deed", "text"),
    [
        (1, r"crashed in a step at t = 0\.2 s: its process was ended by signal SIGSEGV \(Segmentation fault\)"),
        (2, r"crashed in a step at t = 0\.2 s: its process ended itself with exit code 3; the last that it printed "
            r"was: the roof is on fire"),
        (3, r"did not finish a step at t = 0\.2 s within 1 s \(--step-timeout\); its process was ended"),
        (4, r"crashed in a step at t = 0\.2 s: its process was ended by signal SIGABRT \(Aborted\)"),
        (6, r"crashed in a step at t = 0\.2 s: its process ended itself with exit code 0"),
        (7, r"crashed in a step at t = 0\.2 s: its process "),
        (8, r"disturbed the exchange with the master in a step at t = 0\.2 s"),
    ],
)  # fmt: skip
def test_what_an_fmu_does_to_itself_is_told(isolate, deed, text):
    instance, inputs, outputs = isolate(step_timeout=1.0 if deed == 3 else None, deed=deed, at=0.15)
    for n in range(2):
        advance(instance, inputs, 0.1 * n, 1.0)
    with pytest.raises(SlaveError, match=rf"^component 'toy' \(Crasher\.fmu\) {text}"):
        advance(instance, inputs, 0.2, 1.0)
    assert outputs.tolist() == [2.0]  # as before the step
    assert instance.remark() == ""
    instance.release(1)
    with pytest.raises(SlaveError, match=r"component 'toy' \(Crasher\.fmu\) has ended"):
        instance.step(0.3, 0.1)
    instance.close()
    instance.close()


def test_an_error_is_told_in_the_same_words_as_without_isolation(isolate, crasher):
    texts = []
    plain = Instance(crasher())
    a, b = np.zeros(1), np.zeros(1)
    plain.bind(a, b)
    plain.start(0.0, 1.0)
    plain.finish_initialisation()
    for instance, inputs in ((plain, a), isolate()[:2]):
        with pytest.raises(SlaveError) as caught:
            advance(instance, inputs, 0.0, 1e3)
        texts.append(str(caught.value))
    plain.close()
    assert texts[0] == texts[1]
    assert texts[0].startswith("component 'toy' (Crasher.fmu) failed in a step at t = 0 s, status discard")


def test_what_an_fmu_prints_disturbs_nobody(isolate, capfd):
    instance, inputs, outputs = isolate(deed=5)
    for n in range(20):
        advance(instance, inputs, 0.1 * n, 1.0)
    assert outputs.tolist() == [20.0]
    assert capfd.readouterr() == ("", "")


def test_an_fmu_that_cannot_be_instantiated_is_named(crasher, monkeypatch):
    monkeypatch.setenv("TOY_REFUSES", "yes")
    instance = IsolatedInstance(crasher(), Isolation())
    instance.bind(np.zeros(1), np.zeros(1))
    with pytest.raises(SlaveError, match=r"component 'toy': Crasher\.fmu cannot be loaded"):
        instance.start(0.0, 1.0)
    instance.close()


def test_files_are_removed(isolate):
    instance, *_ = isolate()
    folder = Path(instance._process._folder)
    assert any(folder.iterdir())
    instance.close()
    assert not folder.exists()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a child notices at its next request")
def test_a_child_in_an_endless_loop_ends_with_its_master(crasher_fmu):
    script = f"""
        import numpy as np
        from pathlib import Path
        from master.fmu.fmu_description import read_fmu
        from master.fmu.isolation.isolated_instance import IsolatedInstance, Isolation
        from master.system.components import Component
        fmu = read_fmu(Path({str(crasher_fmu)!r}))
        toy = IsolatedInstance(Component("toy", fmu, {{"deed": 10}}, ("u",), ("pid",)), Isolation())
        pid = np.zeros(1)
        toy.bind(np.zeros(1), pid)
        toy.start(0.0, 1.0)
        toy.finish_initialisation()
        toy.read()
        toy.step(0.0, 0.1)
        print(int(pid[0]), flush=True)
        toy.read()
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as master:
        pid = int(master.stdout.readline())
        os.kill(pid, 0)
        os.kill(master.pid, signal.SIGKILL)
    deadline = time.monotonic() + 30.0
    while is_running(pid) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not is_running(pid)


def is_running(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"  # dead, and nobody has asked how
