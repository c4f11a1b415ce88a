"""The installed command: every verb reaches its package, and a mistake is one sentence."""

from __future__ import annotations

import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import openpanto
from openpanto import VERBS, command_line

ROOT = Path(__file__).parents[1]
#: What an installer makes of the entry point in pyproject.toml.
SCRIPT = "import sys\nfrom openpanto import main\nif __name__ == '__main__':\n    sys.exit(main())\n"


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    """The console script as an installer writes it: its own folder, and not the working one, is on the path."""
    path = tmp_path_factory.mktemp("bin") / "openpanto"
    path.write_text(SCRIPT)
    return path


@pytest.fixture
def call(script, tmp_path):
    """Call the command in an empty folder."""

    def called(*arguments, **more):
        command = [sys.executable, script, *arguments]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, **more)

    return called


def test_pyproject_installs_the_command_and_its_module():
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert data["project"]["scripts"] == {"openpanto": "openpanto:main"}
    assert data["tool"]["setuptools"]["py-modules"] == ["openpanto"]


def test_every_verb_of_the_packages_has_its_options_and_is_carried_out_by_them():
    verbs = command_line()._subparsers._group_actions[0].choices
    assert list(verbs) == list(VERBS)
    for name, parser in verbs.items():
        assert parser.prog == f"openpanto {name}"
        assert parser.format_help().startswith(f"usage: openpanto {name} ")


@pytest.mark.parametrize("verb", VERBS)
def test_examples_of_every_verb_are_in_its_help_and_understood(verb):
    parser = command_line([verb])
    text = parser._subparsers._group_actions[0].choices[verb].format_help()
    for example in VERBS[verb].examples:
        assert f"\n  openpanto {example}\n" in text
        assert example.startswith(verb)
        parser.parse_args(shlex.split(example))


@pytest.mark.parametrize("asked", ["--version", "--help"])
def test_version_and_help_import_nothing_that_takes_time(asked):
    code = (
        f"import sys, openpanto\ntry:\n    openpanto._worked([{asked!r}])\nfinally:\n"
        "    assert not {'numpy', 'rich', 'pydantic', 'lxml'} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "openpanto" in done.stdout


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (["rnu", "x"], "there is no verb 'rnu'; did you mean 'run'?"),
        (["quux"], "there is no verb 'quux'"),
        (["cx_ln2.ssp"], "there is no verb 'cx_ln2.ssp'; to run a scenario: openpanto run cx_ln2.ssp"),
        (["run", "x", "--sheme", "jacobi"], "unrecognized arguments: --sheme jacobi; did you mean '--scheme'?"),
        (["run", "x", "--scheme", "jacoby"], "'gauss-seidel', 'iterative'); did you mean 'jacobi'?"),
    ],
)
def test_a_mistyped_word_is_told_with_what_it_may_have_been(line, said, capsys):
    with pytest.raises(SystemExit) as end:
        openpanto._worked(line)
    assert end.value.code == 2
    assert capsys.readouterr().err.endswith(f"{said}\n")


def test_the_packages_that_nothing_works_without_are_those_of_pyproject():
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())
    names = [text.replace("=", ">").partition(">")[0] for text in data["project"]["dependencies"]]
    assert sorted(openpanto.REQUIRED) == sorted(names)


def test_doctor_names_versions_and_what_is_there(call):
    done = call("doctor")
    assert done.returncode == 0, done.stdout
    assert "ok       numpy " in done.stdout
    assert "lines are stepped by " in done.stdout
    assert done.stderr == ""
