"""What FMUs warn of: once each, from initialization and the first step, in every place where it is looked for."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from master.commands.main import main
from master.coupling.fmu_warnings import FmuWarning, FmuWarningObserver
from master.coupling.network import Network
from master.fmu import fmi_log
from master.report.run_page import _head
from master.results.run_results import Results


@pytest.fixture
def talker(fake_slave):
    """A slave that warns of what is in ``words``."""

    class Talker(fake_slave):
        words: tuple[str, ...] = ()

        def warnings(self):
            return self.words

    return Talker("line", (), (), np.zeros(0), lambda state, *_: state)


def test_every_warning_is_told_once_and_none_after_the_first_step(talker, fake_slave):
    loud, silent = talker, fake_slave("train", (), (), np.zeros(0), lambda state, *_: state)
    network, reported = Network([loud, silent], []), []
    observer = FmuWarningObserver(reported.append)
    loud.words = ("slack",)
    observer.begin(0.0, network)
    assert reported == [FmuWarning("line", "slack")]
    loud.words = ("slack", "too long")
    observer.observe(1, 0.1, network)
    loud.words = ("slack", "too long", "later")
    observer.observe(2, 0.2, network)
    assert reported == observer.warnings == [FmuWarning("line", "slack"), FmuWarning("line", "too long")]
    assert str(reported[0]) == "warning: component 'line' says: slack"


@pytest.fixture
def log():
    """Function that logs as an FMU does; what it said is forgotten afterwards."""
    yield lambda status, text: fmi_log._log(None, b"line", status, b"", text.encode())
    fmi_log.clear("line")


def test_a_warning_does_not_stand_for_an_error(log):
    log(3, "it broke")
    log(1, "slack")
    log(1, "slack")
    log(0, "all is well")
    assert fmi_log.last_words("line") == "it broke"
    assert fmi_log.warnings("line") == ("slack",)


def test_a_warning_is_quoted_where_no_error_was_said(log):
    assert fmi_log.last_words("line") == ""
    log(1, "slack")
    assert fmi_log.last_words("line") == "slack"


@pytest.mark.parametrize("how", [[], ["--isolate"]])
def test_a_run_shows_and_keeps_them(toy, tmp_path, capfd, how):
    folder = tmp_path / "r"
    command = ["run", str(toy), "--no-build", "--stop", "0.05", "--out", str(folder), "--set", "catenary.warn=1", *how]
    assert main(command) == 0
    shown = capfd.readouterr().err
    assert shown.count("warning: component 'catenary' says: the wire [sags] :100:\n") == 1
    assert shown.count("warning:") == 1
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["warnings"] == [{"component": "catenary", "text": "the wire [sags] :100:"}]
    assert "catenary warns: the wire [sags]" in (folder / "report.html").read_text()


@pytest.mark.parametrize("how", [[], ["--isolate"]])
def test_what_is_said_long_after_the_first_step_is_shown_once(toy, tmp_path, capfd, how):
    folder = tmp_path / "r"
    command = ["run", str(toy), "--no-build", "--no-report", "--stop", "0.05", "--out", str(folder), *how]
    assert main([*command, "--set", "catenary.warn_at=0.02"]) == 0
    assert capfd.readouterr().err.count("warning: component 'catenary' says: the wire is hot after 0.02 s\n") == 1
    said = json.loads((folder / "summary.json").read_text())["warnings"]
    assert said == [{"component": "catenary", "text": "the wire is hot after 0.02 s"}]


def test_a_quiet_run_keeps_them_in_its_summary(toy, tmp_path, capfd):
    folder = tmp_path / "r"
    command = ["run", str(toy), "--no-build", "--no-report", "--quiet", "--stop", "0.05", "--out", str(folder)]
    assert main([*command, "--set", "catenary.warn=1"]) == 0
    assert capfd.readouterr().err == ""
    assert len(json.loads((folder / "summary.json").read_text())["warnings"]) == 1


def test_the_report_does_not_take_them_for_markup():
    said = [{"component": "<b>", "text": "<script>"}]
    summary = {"status": "complete", "warnings": said, "scenario_warnings": ["<i>"]}
    page = _head(Results(Path(), summary, (), {}), ())
    assert "&lt;b&gt; warns: &lt;script&gt;" in page
    assert "<script>" not in page
    assert "<i>" not in page
    assert "&lt;i&gt;" in page
