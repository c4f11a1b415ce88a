"""Asking a command in this process, and what every answer to a broken input has to be."""

from __future__ import annotations

import contextlib
import io
import signal
import time
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
from hypothesis import HealthCheck, settings

#: Inputs tried so far in this process, by kind; `test_total` adds them up.
TRIED: Counter[str] = Counter()
#: CPU time that an answer may take, and after which it counts as a hang [s].
ANSWER_SECONDS = 1.0
HANG_SECONDS = 20.0
#: The same examples in every run; time is measured below, in CPU seconds, which a busy machine does not stretch.
PROFILE = settings(
    derandomize=True,
    deadline=None,
    print_blob=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
)
#: What must not be read in any message.
UNWORDED = ("Traceback", "Warning", "<class", "object at 0x", "NoneType")


class HangError(BaseException):
    """No answer; no handler of ordinary errors may swallow it."""


@dataclass(frozen=True)
class Answer:
    """What a command said: exit code, standard output, standard error, CPU time [s]."""

    code: int
    out: str
    err: str
    seconds: float


def ask(main: Callable[[Sequence[str]], int], *arguments: object) -> Answer:
    """Call a command's ``main``; a warning that it lets out is part of what it says."""
    out, err = io.StringIO(), io.StringIO()
    signal.signal(signal.SIGVTALRM, _hang)
    signal.setitimer(signal.ITIMER_VIRTUAL, HANG_SECONDS)
    begin = time.process_time()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("always")
            # Python keeps these to itself too: they come when memory is cleared up, long after their cause.
            warnings.simplefilter("ignore", ResourceWarning)
            warnings.showwarning = lambda *about, **_: err.write(f"{about[1].__name__}: {about[0]}\n")
            code = _exit_code(main, [str(a) for a in arguments])
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    return Answer(code, out.getvalue(), err.getvalue(), time.process_time() - begin)


def _exit_code(main: Callable[[Sequence[str]], int], arguments: list[str]) -> int:
    try:
        return main(arguments)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(bool(stop.code))


def _hang(*_: object) -> None:
    raise HangError(f"no answer within {HANG_SECONDS} s of CPU time")


def assert_quick(answer: Answer) -> None:
    """Whatever the answer is, it comes within a second and holds nothing that is not meant for users."""
    assert answer.seconds < ANSWER_SECONDS, answer
    for text in UNWORDED:
        assert text not in answer.err, answer.err


def assert_refused(answer: Answer, *parts: str, code: int = 1) -> None:
    """The answer is an error in words, which says every one of ``parts``."""
    assert_quick(answer)
    assert answer.code == code, answer
    said = " ".join(answer.err.split())
    assert "error: " in said, answer
    for part in parts:
        assert part in said, (part, said)
    assert_lines(answer.err.splitlines())


def assert_accepted(answer: Answer, *parts: str, warned: Sequence[str] = ()) -> None:
    """The command did its work and had nothing to complain about but what it had to warn of."""
    assert_quick(answer)
    assert answer.code == 0, answer
    if not warned:
        assert answer.err == "", answer
    said = " ".join(answer.err.split())
    for part in warned:
        assert part in said, (part, said)
    assert said.count("warning: ") == len(warned), said
    for part in parts:
        assert part in answer.out, (part, answer.out)


def assert_worded(error: Exception, file: str) -> None:
    """Every line of an error names the file and can be read."""
    lines = str(error).splitlines()
    assert_lines(lines)
    assert all(file in line for line in lines if not line.startswith("... and")), lines


def assert_lines(lines: Sequence[str]) -> None:
    """Messages can be read: one line each, of readable length and characters, and not too many of them."""
    assert len(lines) <= 110, len(lines)
    for line in lines:
        assert len(line) <= 1200, len(line)
        assert line.isprintable(), repr(line)


def put_file(path: Path, content: str | bytes) -> None:
    """Write a file in the place of an old one, which is taken away first: where it is cut to nothing instead, some file
    systems wait for the disk, four milliseconds for every input that is tried.
    """
    path.unlink(missing_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


Declared = tuple[str, str, str]


def make_fmu(path: Path, variables: Sequence[Declared], attributes: str = "", before: str = "") -> Path:
    """Write an FMU that holds a description and an empty library: name, causality and unit of every variable.

    ``attributes`` go to every variable, ``before`` stands before the root element.
    """
    units = dict.fromkeys(u for _, _, u in variables if u)
    definitions = "".join(f'<Unit name="{u}"/>' for u in units)
    lines = "".join(_scalar(i, *v, attributes) for i, v in enumerate(variables))
    name = path.stem
    xml = (
        f'<?xml version="1.0" encoding="UTF-8"?>{before}\n<fmiModelDescription fmiVersion="2.0" modelName="{name}" '
        f'guid="{name}">\n<CoSimulation modelIdentifier="{name}" canGetAndSetFMUstate="true"/>\n'
        f"<UnitDefinitions>{definitions}</UnitDefinitions>\n"
        f"<ModelVariables>{lines}</ModelVariables>\n<ModelStructure/></fmiModelDescription>\n"
    )
    path.unlink(missing_ok=True)  # see `put_file`
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("modelDescription.xml", xml)
        file.writestr(f"binaries/{fmpy.platform}/{name}{fmpy.sharedLibraryExtension}", "")
    return path


def _scalar(reference: int, name: str, causality: str, unit: str, attributes: str) -> str:
    variability = "tunable" if causality == "parameter" else "continuous"
    kind = f'unit="{unit}"' if unit else ""
    start = 'start="1"' if causality in ("parameter", "input") else ""
    return (
        f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" '
        f'variability="{variability}"><Real {kind} {start} {attributes}/></ScalarVariable>\n'
    )
