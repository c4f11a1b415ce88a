"""Text and numbers from FMUs and files of others: shown, not obeyed; nonsense is a failure or a warning."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest

from master.commands.main import main
from master.coupling.fmu_warnings import LARGEST, FmuWarningObserver
from master.coupling.network import Network
from master.errors import MasterError, SlaveError
from master.fmu import fmi_log
from master.fmu.fmu_description import read_fmu
from master.fmu.instance import LONGEST_STATE, Instance
from master.recording.recorder import RecordedValues, Recorder
from master.recording.recording import load
from master.report.result_tables import figures_table, plain_table
from master.report.terminal_summary import Terminal, printable_json
from master.safety.safe_files import plain_cell, safe_cell
from master.system.components import Component

#: Clear the screen; a title; the one-byte form of a control sequence; text that runs backwards; a bell.
NASTY = ("\x1b[2J", "\x1b]0;owned\x07", "\x9b31m", "\u202egnp.exe", "\x1b[1A\x1b[2Kpassed")
FORMULAS = ("=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "'=1", "''=1")


@pytest.mark.parametrize("text", NASTY)
def test_a_terminal_shows_what_does_not_print(text):
    stream = io.StringIO()
    terminal = Terminal(file=stream, width=80, force_terminal=True, color_system="standard")
    terminal.print(text, style="red", markup=False)
    terminal.print(plain_table([text, "b"], [[text, "1"]]))
    said = stream.getvalue()
    assert text not in said
    assert text[0].encode("unicode_escape").decode() in said
    assert "\x1b[31m" in said  # its own colours stay


def test_a_line_stays_a_line_and_letters_stay():
    stream = io.StringIO()
    Terminal(file=stream, width=80).print("Fahrdraht: 5.5 m\nStützpunkt, m²", markup=False)
    assert stream.getvalue() == "Fahrdraht: 5.5 m\nStützpunkt, m²\n"


@pytest.mark.parametrize("text", NASTY)
def test_json_says_the_same_and_prints(text):
    data = {"reason": text, "scenario": "Stützpunkt"}
    shown = printable_json(json.dumps(data, ensure_ascii=False, indent=1))
    assert all(line.isprintable() for line in shown.splitlines())
    assert json.loads(shown) == data


@pytest.mark.parametrize("text", NASTY)
def test_what_an_fmu_says_prints(text):
    fmi_log._log(None, b"line", 3, b"", text.encode())
    try:
        assert fmi_log.last_words("line").isprintable()
    finally:
        fmi_log.clear("line")


def test_an_error_that_quotes_a_file_prints(tmp_path, capsys):
    (tmp_path / "study.toml").write_text('title = "x"\n[[interval]]\nname = "a"\nstart = 0\nend = 1\n')
    (tmp_path / "variants.csv").write_text("variant,stop\n\x1b[2Ja,1\n\x1b[2Ja,1\n")
    assert main(["study", str(tmp_path), "--list"]) == 1
    assert "\x1b[2J" not in capsys.readouterr().err


def test_names_of_variants_print(tmp_path, capsys):
    (tmp_path / "study.toml").write_text('title = "\\u001b[2Jx"\n[[interval]]\nname = "a"\nstart = 0\nend = 1\n')
    (tmp_path / "variants.csv").write_text("variant,stop\n\x1b[2Ja,1\n")
    assert main(["study", str(tmp_path), "--list"]) == 0
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert "x1b[2Ja" in said


@pytest.mark.parametrize("text", FORMULAS)
def test_no_cell_is_a_formula_and_none_is_lost(text):
    cell = safe_cell(text)
    assert cell.startswith("'")
    assert plain_cell(cell) == text


@pytest.mark.parametrize("text", ["31 m", "contact.force [N]", "", "'quoted'", "a=b"])
def test_other_cells_stay(text):
    assert safe_cell(text) == text == plain_cell(text)


def test_titles_of_a_recording_are_no_formulas(tmp_path, fake_slave):
    slave = fake_slave("a", (), (), np.zeros(0), lambda state, *_: state)
    names = [f"{formula}.x" for formula in FORMULAS if "\t" not in formula]
    recorder = Recorder(tmp_path / "timeseries.csv", [RecordedValues(names, np.zeros(len(names)))], {}, 1)
    recorder.begin(0.0, Network([slave], []))
    recorder.finish()
    head = next(csv.reader((tmp_path / "timeseries.csv").read_text().splitlines()))
    assert all(cell.startswith("'") for cell in head[1:])
    assert load(tmp_path / "timeseries.csv").names == tuple(names)


@pytest.fixture
def instance(toy_fmus):
    fmu = read_fmu(toy_fmus / "ToyPantograph.fmu")
    made = Instance(Component("pan", fmu, {}, ("contact.force",), ("A.z",)))
    made.bind(np.zeros(1), np.zeros(1))
    made.start(0.0, 1.0)
    made.finish_initialisation()
    yield made
    made.close()


@pytest.mark.parametrize("status", [-1, -(2**31), 6, 2**31 - 1])
def test_a_status_that_fmi_does_not_know_is_a_failure(instance, monkeypatch, status):
    monkeypatch.setattr(instance, "_do_step", lambda *_: status)
    with pytest.raises(SlaveError, match=rf"failed in a step at t = 0 s, status {status}, which FMI does not know: "):
        instance.step(0.0, 0.1)


def test_it_is_one_when_reading_and_writing_too(instance, monkeypatch):
    for group, name, call in ((instance._outputs, "_get", instance.read), (instance._inputs, "_set", instance.write)):
        monkeypatch.setattr(group, name, lambda *_: -1)
        with pytest.raises(SlaveError, match="status -1"):
            call()
    monkeypatch.setattr(instance, "function", lambda _: lambda *_: -1)
    with pytest.raises(SlaveError, match=r"saving its state.*status -1"):
        instance.save()


@pytest.mark.parametrize("size", [2**40, 2**63, LONGEST_STATE + 1])
def test_a_state_of_impossible_size_is_refused(instance, size):
    with pytest.raises(SlaveError, match=rf"'pan' .* claims a state of {size} bytes, more than"):
        instance._room(size)


def test_the_claim_is_looked_at_before_there_is_room_for_it(instance, monkeypatch):
    real = instance.function

    def claim(_handle, _state, size):
        size._obj.value = 2**40
        return 0

    monkeypatch.setattr(instance, "function", lambda n: claim if n == "fmi2SerializedFMUstateSize" else real(n))
    with pytest.raises(SlaveError, match="claims a state of 1099511627776 bytes"):
        instance.serialise()


def test_values_that_cannot_be_are_warned_of_once(fake_slave):
    slave = fake_slave("line", (), ("a", "b"), np.zeros(2), lambda state, *_: state)
    network, reported = Network([slave], []), []
    observer = FmuWarningObserver(reported.append)
    observer.begin(0.0, network)
    for step, value in enumerate((LARGEST, -1e300, 1e300), 1):
        network.outputs[:] = (1.0, value)
        observer.observe(step, 0.1 * step, network)
    assert [str(c) for c in reported] == [
        "warning: component 'line': b became -1e+300 at t = 0.2 s, larger than anything here can be (1e+15); the "
        "results mean nothing"
    ]


def test_a_run_with_values_that_cannot_be_says_so(toy, tmp_path, capsys):
    command = [str(toy), "--no-build", "--no-report", "--stop", "0.01", "--set", "pantograph.speed=1e300"]
    assert main([*command, "--out", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "component 'pantograph': A.vx became 1e+300 at t = 0 s" in said
    assert any("1e+300" in w["text"] for w in json.loads((tmp_path / "out/summary.json").read_text())["warnings"])


def test_a_table_takes_no_markup_from_names():
    stream = io.StringIO()
    Terminal(file=stream, width=80).print(figures_table([], ["[/]", "[red]x"], []))
    assert "[red]x" in stream.getvalue()
    assert issubclass(SlaveError, MasterError)
