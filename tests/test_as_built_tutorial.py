"""The tutorial from a measuring run to a corrected line: its commands give the figures that it prints."""

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from models.commands.physics_main import main
from models.library.catalogue import load_line

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "tutorials" / "as-built.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^openpanto asbuilt (.*)$", PAGE, re.MULTILINE)
ROWS = dict(re.findall(r"^\| (\w[^|]*\w[^|]*) \| ([^|]+) \|$", PAGE, re.MULTILINE))


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A folder in which the tutorial's first command was given, and what it printed."""
    folder = tmp_path_factory.mktemp("tutorial")
    (folder / "docs").symlink_to(ROOT / "docs")
    with pytest.MonkeyPatch.context() as patch, pytest.MonkeyPatch.context() as output:
        patch.chdir(folder)
        output.setenv("COLUMNS", "400")
        assert main(["asbuilt", *COMMANDS[0].split()]) == 0
    return folder


@pytest.fixture(scope="module")
def droppers(workplace):
    with (workplace / "asbuilt" / "droppers.csv").open() as file:
        return list(csv.DictReader(file))


def column(droppers, name):
    return np.array([float(row[name]) if row[name] else np.nan for row in droppers])


@pytest.fixture(scope="module")
def truth():
    sys.path.insert(0, str(ROOT / "docs" / "examples"))
    try:
        import measuring_run
    finally:
        sys.path.pop(0)
    return measuring_run.line_and_errors()[1]


def test_figures_are_those_of_the_page(workplace):
    page = re.sub(r"<[^>]*>", " ", (workplace / "asbuilt" / "asbuilt.html").read_text(encoding="utf-8"))
    told = ROWS.items() - {("quantity", "value")}
    assert len(told) == 10
    for name, value in told:
        assert name in page, name
        assert value in page, f"{name}: {value}"
    assert "droppers that hang slack, or may: 5; they may be longer than heights tell" in page


def test_what_was_hidden_in_the_run_is_found(droppers, truth):
    error, uncertainty, slack = (column(droppers, n) for n in ("error [mm]", "standard error [mm]", "slack"))
    told = np.isfinite(error) & (slack == 0.0)
    off = (error - 1e3 * truth)[told] / uncertainty[told]
    pattern = r"the largest error is (\S+) mm, .*? and of\s+the (\d+) droppers .*? by (\S+) of.*?; (\S+) at"
    said = re.search(pattern, PAGE, re.DOTALL)
    worst = truth[np.abs(truth).argmax()]
    assert said is not None
    assert (f"{1e3 * worst:.1f}", str(told.sum())) == said.groups()[:2]
    assert (f"{np.sqrt(np.mean(off**2)):.2f}", f"{np.abs(off).max():.1f}") == said.groups()[2:]


def test_both_lines_are_lines_like_any_other(workplace, droppers):
    built, corrected = (load_line(str(workplace / "asbuilt" / f"{name}.toml")) for name in ("asbuilt", "corrected"))
    change = np.subtract(corrected.sections[0].length_errors, built.sections[0].length_errors)
    assert 1e3 * change == pytest.approx(column(droppers, "change [mm]"), abs=2e-3)
    assert (built.name, corrected.name) == ("asbuilt", "corrected")
    assert built.running_surface is None


def test_the_first_commands_are_those_of_the_page():
    assert len(COMMANDS) == 2
    assert "--only 10" in COMMANDS[1]


@pytest.mark.long
@pytest.mark.parametrize("name", ["designed", "built", "corrected"])
def test_a_run_gives_the_figures_of_the_page(workplace, name):
    """Of which the normal run has the line at rest, in test_fitted_lengths and test_line_as_built."""
    new, run = (re.search(rf"^openpanto ({verb} {name}.*)$", PAGE, re.MULTILINE) for verb in ("new", "run"))
    row = re.search(rf"^\| {name} \| (\S+) \| (\S+) \| (\S+) \| (\S+) \|$", PAGE, re.MULTILINE)
    assert None not in (new, run, row)
    for command in (new[1], run[1]):
        done = subprocess.run(
            [sys.executable, "-m", "openpanto", *command.split()], cwd=workplace, capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    names = ("standard deviation [N]", "maximum [N]", "minimum [N]", "slack droppers at passage [%]")
    told = [re.search(rf"│ {re.escape(n)} +│ +(\S+) │", done.stdout)[1] for n in names]
    assert tuple(told) == row.groups()
