"""A run that is saved and continued is the run that was not interrupted, to the last bit."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from master.commands.main import main
from master.coupling.coupling_schemes import Iterative, Jacobi
from master.errors import RunError
from master.recording import checkpoint
from master.recording.continuation import Continuation
from master.recording.recording import load
from master.run_session import connected_fmus
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from tests.master.recording.conftest import go


@pytest.mark.parametrize("scheme", ["jacobi", "gauss-seidel", "iterative"])
def test_continued_rows_are_those_of_the_whole_run(toy, tmp_path, scheme):
    whole = go(toy, tmp_path / "whole", "--scheme", scheme, "--checkpoint", "0.1", "--stop", "0.3")
    file = tmp_path / "whole" / checkpoint.NAME
    rest = go(toy, tmp_path / "rest", "--scheme", scheme, "--resume", str(file), "--stop", "0.3")
    assert len(rest) == 1 + 201
    assert rest[0] == whole[0]
    assert rest[1:] == whole[101:]
    summary = json.loads((tmp_path / "rest" / "summary.json").read_text())
    assert summary["resumed"] == {"file": str(file), "time": 0.1, "renewed": []}


def test_saving_changes_nothing(toy, tmp_path, saved):
    assert go(toy, tmp_path / "plain", "--stop", "0.3") == saved[0]


def test_continued_in_its_own_folder(toy, saved):
    whole, file = saved
    assert go(toy, file.parent, "--resume", str(file), "--stop", "0.3")[1:] == whole[101:]


def test_continued_with_another_step(toy, tmp_path, saved):
    go(toy, tmp_path / "fine", "--resume", str(saved[1]), "--step", "0.0005", "--stop", "0.2")
    time = load(tmp_path / "fine" / "timeseries.csv").time
    assert time[[0, 1, -1]] == pytest.approx([0.1, 0.1005, 0.2])


def test_a_settled_line_takes_a_new_pantograph(toy, tmp_path, saved):
    rest = tmp_path / "rest"
    go(toy, rest, "--resume", str(saved[1]), "--renew", "pantograph", "--set", "pantograph.static_force=99")
    recording = load(rest / "timeseries.csv")
    assert recording.time[0] == 0.1
    assert recording["pantograph.A.x"][0] == 0.0
    assert recording["catenary.pantograph[1].contact.force"][-1] == pytest.approx(99.0, abs=20.0)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--set", "pantograph.static_force=99"], "pantograph.static_force was 140.0, is 99.0 (--renew pantograph"),
        (["--stop", "0.1"], "saved at 0.1 s, the run would end at 0.1 s"),
        (["--renew", "train"], "there is no component 'train'"),
        (["--checkpoint", "0.10003"], "not a communication point"),
        (["--checkpoint", "7"], "not a communication point"),
    ],
)
def test_what_does_not_fit_is_said_before_anything_is_run(toy, tmp_path, saved, capsys, options, text):
    command = [str(toy), "--no-build", "--quiet", "--out", str(tmp_path / "no"), "--resume", str(saved[1])]
    assert main([*command, *options]) == 1
    assert text in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "no").exists()


def test_renew_needs_resume(toy, tmp_path, capsys):
    assert main([str(toy), "--no-build", "--quiet", "--out", str(tmp_path / "no"), "--renew", "pantograph"]) == 2
    assert "--resume" in capsys.readouterr().err


def test_an_fmu_that_restores_less_than_its_state_is_found_out(toy, saved):
    found = checkpoint.read(saved[1])
    wrong = replace(found, outputs={**found.outputs, "pantograph.A.z": 1.0})
    with open_scenario(toy, Overrides(), build=False) as scenario:
        way = Continuation(wrong, "state")
        with (
            connected_fmus(scenario.system) as network,
            pytest.raises(RunError, match="does not restore its whole state"),
        ):
            way.prepare(network, Jacobi(), way.grid(scenario.system))


def test_a_run_that_goes_on_has_its_scheme_s_memory(toy, tmp_path):
    """Into the file and out of it: the iterative scheme measures changes by the largest values so far."""
    go(toy, tmp_path / "whole", "--scheme", "iterative", "--checkpoint", "0.1", "--stop", "0.3")
    found = checkpoint.read(tmp_path / "whole" / checkpoint.NAME)
    assert len(found.memory) == len(found.outputs)
    for name, largest in zip(found.outputs, found.memory, strict=True):
        assert largest >= abs(found.outputs[name])
    with open_scenario(toy, Overrides(scheme="iterative"), build=False) as scenario:
        for renewed, expected in (((), found.memory.tolist()), (("pantograph",), [])):
            way, scheme = Continuation(found, "state", renewed=renewed), Iterative()
            with connected_fmus(scenario.system) as network:
                way.prepare(network, scheme, way.grid(scenario.system))
                assert scheme.save().tolist() == expected
                if not renewed:
                    assert dict(zip(network.output_names, network.outputs.tolist(), strict=True)) == found.outputs
                    reported = dict(zip(network.input_names, network.inputs.tolist(), strict=True))
                    assert reported == found.inputs


def test_a_scheme_does_not_take_another_s_memory(toy, saved):
    found = replace(checkpoint.read(saved[1]), memory=np.array([1.0, 2.0]))
    with open_scenario(toy, Overrides(), build=False) as scenario, connected_fmus(scenario.system) as network:
        way, scheme = Continuation(found, "state"), Iterative()
        way.prepare(network, scheme, way.grid(scenario.system))
        assert not scheme.save().size
