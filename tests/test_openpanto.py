"""The installed command: every verb reaches its package, and a mistake is one sentence."""

from __future__ import annotations

import multiprocessing.process
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import openpanto
from openpanto import VERBS, command_line
from tests.effort import rest

ROOT = Path(__file__).parents[1]
#: What help does without.
HEAVY = ("numpy", "scipy", "matplotlib", "fmpy", "pandas", "numba", "pydantic")
#: What an installer makes of the entry point in pyproject.toml.
SCRIPT = "import sys\nfrom openpanto import main\nif __name__ == '__main__':\n    sys.exit(main())\n"


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    """The console script as an installer writes it: its own folder, and not the working one, is on the path."""
    path = tmp_path_factory.mktemp("bin") / "openpanto"
    path.write_text(SCRIPT)
    return path


@pytest.fixture
def foreign(tmp_path):
    """A working folder with files and packages of the same names as those that are imported."""
    for name in ("rich", "numpy", "lxml", "pydantic", "fmpy", "pythonfmu", "filelock", "openpanto", "argparse"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('FOREIGN')")
    for name in ("models", "master", "fmus"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise SystemExit('FOREIGN')")
    return tmp_path


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
        assert f"\n  openpanto {example}\n" in text.replace(" \\\n      ", " ")
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
        (["quux"], "there is no verb 'quux'; openpanto --help lists them"),
        (["version"], "there is no verb 'version'; it is an option: openpanto --version"),
        (["--verson"], "unrecognized arguments: --verson; did you mean '--version'?"),
        (["-v"], "openpanto: error: unrecognized arguments: -v"),
        (["new", "x", "--pantograf", "CX"], "unrecognized arguments: --pantograf; did you mean '--pantograph'?"),
        (["cx_ln2"], "there is no verb 'cx_ln2'; to run a scenario: openpanto run cx_ln2"),
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


@pytest.mark.parametrize("verb", VERBS)
def test_help_fits_a_terminal_of_80_columns(verb, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = openpanto._verbs(command_line([verb]))[verb].format_help()
    assert max(map(len, text.splitlines())) <= 80


def started(tmp_path, **files):
    """Return what the command says with files in a folder that PYTHONPATH names."""
    for name, text in files.items():
        (tmp_path / f"{name}.py").write_text(text)
    code = "import sys\nfrom openpanto import main\nsys.exit(main(['statics', 'NONE']))"
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    command = [sys.executable, "-P", "-c", code]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": path}
    )
    assert done.returncode == 1
    (sentence,) = done.stderr.splitlines()
    return sentence


@pytest.mark.parametrize("name", ["models", "rich"])
def test_a_foreign_package_by_pythonpath_is_one_sentence(tmp_path, name):
    said = started(tmp_path, **{name: "x = 1"})
    assert said.startswith(f"error: {tmp_path / name}.py ")
    assert said.endswith(": take its folder out of PYTHONPATH")


def test_the_packages_that_nothing_works_without_are_those_of_pyproject():
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())
    names = [text.replace("=", ">").partition(">")[0] for text in data["project"]["dependencies"]]
    assert sorted(openpanto.REQUIRED) == sorted(names)


def test_doctor_names_versions_and_what_is_there(call):
    done = call("doctor")
    assert done.returncode == ("missing " in done.stdout)
    assert "ok       numpy " in done.stdout
    assert "lines are stepped by " in done.stdout
    assert done.stderr == ""


@pytest.mark.parametrize(
    "line",
    [
        ["run", "cx_ln2", "--stop", "0.01", "--quiet", "--no-report", "--isolate"],
        *rest(["build", "Pantograph_CX", "--out", "fmus_here"], ["doctor"]),
    ],
    ids=lambda line: line[0],
)
def test_foreign_files_and_packages_in_the_working_folder_change_nothing(line, foreign, call):
    done = call(*line, env={**os.environ, "OPENPANTO_KERNEL": "numpy"})
    assert (done.returncode, "FOREIGN" in done.stdout + done.stderr) == (0, False), done.stderr


@pytest.mark.parametrize("package", ["master", "models", "fmus"])
def test_the_packages_as_commands_heed_no_foreign_file_either(package, foreign):
    for name in ("models", "master", "fmus"):
        (foreign / name).rename(foreign / f"{name}_away")
    (foreign / ("models" if package == "fmus" else "fmus")).mkdir()
    command = [sys.executable, "-m", package, "--help"]
    done = subprocess.run(command, cwd=foreign, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_foreign_package_in_place_of_a_command_is_one_sentence(tmp_path):
    (tmp_path / "master").mkdir()
    (tmp_path / "master" / "__init__.py").touch()
    command = [sys.executable, "-m", "master", "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    if done.returncode == 0:  # an editable installation supplies what the foreign package lacks
        assert (done.stderr, "usage: python -m master" in done.stdout) == ("", True)
    else:
        assert (done.returncode, done.stderr.count("\n")) == (1, 1)
        assert "No module named master.__main__" in done.stderr


@pytest.mark.parametrize("line", [["study", "--list"], ["statics", "LN2"], ["--completion", "bash"]], ids=" ".join)
def test_a_reader_that_has_gone_away_ends_the_command_quietly(line, script):
    if "--completion" in line:
        pytest.importorskip("shtab")
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([sys.executable, script, *line], stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (1, b"")


#: Sends a signal to the command, as a terminal would, when a module is about to be imported.
AT_IMPORT = """
import os, signal, sys
first, wanted, number = os.getpid(), sys.argv.pop(1), getattr(signal, sys.argv.pop(1))
class Sender:
    def find_spec(self, name, *_):
        if name == wanted:
            os.kill(first, number)
sys.meta_path.insert(0, Sender())
"""


def not_ignored():
    """Have the signals back that whoever started the tests in the background ignores, and their children with them."""
    for name in ("SIGINT", "SIGHUP"):
        signal.signal(getattr(signal, name), signal.SIG_DFL)


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no such signals here")
@pytest.mark.parametrize(
    ("module", "number"),
    [("argparse", "SIGINT"), ("master.errors", "SIGHUP"), ("numpy", "SIGINT"), ("scipy.sparse", "SIGHUP")],
)
def test_an_interrupt_during_the_imports_is_one_sentence(module, number, tmp_path):
    path = tmp_path / "openpanto"
    path.write_text(AT_IMPORT + SCRIPT)
    command = [sys.executable, "-P", path, module, number, "couple", "LN2", "CX", "--quiet"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=False, timeout=60, preexec_fn=not_ignored
    )
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "error: interrupted\n")


def test_an_interrupt_that_an_import_makes_another_error_of_is_one_sentence(tmp_path):
    text = "def work():\n    try:\n        raise KeyboardInterrupt\n    except KeyboardInterrupt as error:\n"
    text += "        raise RuntimeError('Error calling __set_name__') from error\n"
    code = f"from master.safety.supervision import supervised\n{text}raise SystemExit(supervised(work))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "error: interrupted\n")


#: Sends a signal to the command, as a terminal would, in its hundredth step.
AT_STEP = """
import os, signal, sys
from models.catenary.line_model import CatenaryModel
first, step, made = os.getpid(), CatenaryModel.step, []
def stepped(*arguments):
    made.append(None)
    if len(made) == 100:
        os.kill(first, signal.SIGINT)
    return step(*arguments)
CatenaryModel.step = stepped
"""


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no such signals here")
def test_an_interrupt_of_the_physics_is_one_sentence(tmp_path):
    path = tmp_path / "openpanto"
    path.write_text(AT_STEP + SCRIPT)
    line = ["couple", "EN50318_2002", "CX", "--speed", "5", "--quiet"]  # takes minutes
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENPANTO_KERNEL": "numpy"}
    done = subprocess.run(
        [sys.executable, "-P", path, *line], env=environment, capture_output=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (1, b"", b"error: interrupted\n")


#: The last word of a command line as bash completes it.
BASH_TAB = """
source {script}
COMP_WORDS=({line}); COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 )); COMP_LINE="{line}"; COMP_POINT=${{#COMP_LINE}}
$(complete -p openpanto | sed 's/.*-F \\([^ ]*\\).*/\\1/')
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
TAB = {"bash": BASH_TAB, "fish": "source {script}; complete -C '{line}'"}


@pytest.fixture(scope="module", params=["bash", "zsh", "fish"])
def completion(request, tmp_path_factory):
    """A shell, and the script for it."""
    pytest.importorskip("shtab")
    if shutil.which(request.param) is None:
        pytest.skip(f"no {request.param} here")
    path = tmp_path_factory.mktemp("completion") / "openpanto"
    path.write_text(openpanto.completion(request.param))
    return request.param, path


def test_every_shell_reads_its_script(completion):
    shell, path = completion
    done = subprocess.run([shell, "-n", path], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("openpanto va", "validate"),
        ("openpanto run --sch", "--scheme"),
        ("openpanto run cx_ln", "cx_ln2"),
        ("openpanto run own", "own.ssp"),
        ("openpanto couple LN2 C", "CX"),
        ("openpanto build Cat", "Catenary_LN2"),
        ("openpanto study cx_", "cx_ln2_overlap"),
    ],
)
def test_verbs_options_names_and_files_are_completed(completion, line, word, tmp_path):
    shell, path = completion
    if shell not in TAB:
        pytest.skip(f"{shell} completes at its own terminal only")
    (tmp_path / "own.ssp").touch()
    command = [shell, "-c", TAB[shell].format(script=path, line=line)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert word in [offered.partition("\t")[0] for offered in done.stdout.splitlines()], done.stderr


def test_help_version_and_completion_need_nothing_that_takes_time():
    """In one process for all verbs; what is imported on the way to ``VERB --help`` counts."""
    code = f"""
import contextlib, io, sys
import openpanto
for line in [[], ["--version"], ["--help"], *([verb, "--help"] for verb in openpanto.VERBS), ["--completion", "bash"]]:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        with contextlib.suppress(SystemExit):
            openpanto._worked(line)
    found = [name for name in {HEAVY} if name in sys.modules]
    if found:
        sys.exit(f"{{line}} imports {{found}}")
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("parent", "said"), [(None, [b"error: interrupted\n"]), (object(), [])])
def test_an_end_during_the_imports_is_told_by_the_command_and_not_by_its_processes(monkeypatch, parent, said):
    written, codes = [], []
    monkeypatch.setattr(multiprocessing.process, "parent_process", lambda: parent)
    monkeypatch.setattr(openpanto.os, "write", lambda _, text: written.append(text))
    monkeypatch.setattr(openpanto.os, "_exit", codes.append)
    openpanto._end()
    assert (written, codes) == (said, [1])
