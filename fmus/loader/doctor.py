"""What a machine lacks to make FMUs, or to run one, in words: ``python -m fmus doctor X.fmu``."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal
from xml.etree import ElementTree

from fmus.loader.loader_build import DESCRIPTION, INNER_SUFFIX, PROBE, LoaderError, loader_library, needed_versions
from models.definition_files.message_text import said

Level = Literal["ok", "note", "missing"]
#: (system, machine) -> folder and suffix of an FMU's library.
_PLATFORMS: Final = {
    ("Linux", "x86_64"): ("linux64", ".so"),
    ("Windows", "AMD64"): ("win64", ".dll"),
    ("Darwin", "x86_64"): ("darwin64", ".dylib"),
}
_SECONDS: Final = 300
#: The largest size that an FMU of ours may unpack to [bytes]; they take a few megabytes.
_LARGEST: Final = 1024**3
#: What reading a file that is not an FMU can raise: zipfile documents only some of it.
_UNREADABLE: Final = (
    ValueError,
    KeyError,
    EOFError,
    RuntimeError,
    NotImplementedError,
    zipfile.BadZipFile,
    zlib.error,
    ElementTree.ParseError,
)
#: Ahead of what another Python is given: no file in the working folder stands in for a package (-P is for 3.11).
_NOT_HERE: Final = "import sys\nsys.path[:] = [place for place in sys.path if place]\n"
#: What a run does with an FMU: unpacked into a temporary folder, loaded from there, initialised, stepped.
_RUN: Final = """
import ctypes, os, sys
folder, identifier, guid = sys.argv[1:]
from fmpy.fmi2 import (FMU2Slave, fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE, fmi2CallbackFunctions,
                       fmi2CallbackLoggerTYPE)
from fmpy import calloc, free
said = []
log = lambda _e, _n, status, _c, text: said.append(text.decode("utf-8", "replace")) if status > 1 else None
calls = fmi2CallbackFunctions()
calls.logger = fmi2CallbackLoggerTYPE(log)
calls.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
calls.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
try:
    fmu = FMU2Slave(guid=guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName="trial")
    fmu.instantiate(callbacks=calls, loggingOn=True)
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.doStep(0.0, 1e-3)
    fmu.terminate()
    fmu.freeInstance()
except Exception as error:
    print(said[-1] if said else error)
    sys.exit(1)
"""
_TRIAL: Final = """
import sys
folder, script, name = sys.argv[1:]
sys.path.insert(0, folder)
import importlib, scipy.linalg
slave = getattr(importlib.import_module(script), name)(instance_name="trial", resources=folder)
slave.setup_experiment(0.0, None, None)
slave.enter_initialization_mode()
slave.exit_initialization_mode()
sys.exit(0 if slave.do_step(0.0, 1e-3) else 1)
"""


@dataclass(frozen=True)
class Finding:
    """One thing that was checked: fine (ok), worth knowing (note), or an obstacle (missing)."""

    level: Level
    text: str

    def __str__(self) -> str:
        return f"{self.level:8} {self.text}"


@dataclass(frozen=True)
class Interpreter:
    """The Python that a tool would run the FMU with, in its own words (``loader/python_probe.py``)."""

    executable: str
    version: str
    library: str
    lack: str


@dataclass(frozen=True)
class Package:
    """What an FMU's archive holds, as far as it matters here."""

    path: Path
    names: frozenset[str]
    script: str
    identifier: str
    guid: str

    def library(self) -> str:
        """Return the name of the library for this platform, empty if FMUs have none for it."""
        folder, suffix = _PLATFORMS.get((platform.system(), platform.machine()), ("", ""))
        return f"binaries/{folder}/{self.identifier}{suffix}" if folder else ""

    @property
    def has_loader(self) -> bool:
        """Whether it brings Python into hosts that are not Python."""
        return f"binaries/linux64/{self.identifier}{INNER_SUFFIX}" in self.names


def examine_machine() -> list[Finding]:
    """Examine what building FMUs, and running them in other tools, takes on this machine; return all findings."""
    here = f"Python {platform.python_version()} ({sys.executable}) on {platform.system()}, {platform.machine()}"
    return [Finding("ok", here), _loader(), *_python(ask())]


def _loader() -> Finding:
    try:
        loader_library()
    except LoaderError as error:
        return Finding("note", f"FMUs built here get pythonfmu's own library only, without our loader: {error}")
    return Finding("ok", "FMUs built here get our loader, which tools that are not Python run them with")


def examine(path: Path) -> list[Finding]:
    """Examine an FMU and this machine; return all findings."""
    try:
        package = read_package(path)
    except OSError as error:
        return [Finding("missing", f"{path} cannot be read ({said(error)})")]
    except _UNREADABLE as error:
        return [Finding("missing", f"{path} is not an FMU of this kind ({error})")]
    python = ask()
    found = [*_platform(package), *_libraries(package), *_bundled(package), *_run(package), *_python(python)]
    if python is None or python.lack:
        return found
    found += _trial(package, python)
    return found + list(_other_hosts(package, python))


def read_package(path: Path) -> Package:
    """Return what an FMU's archive holds.

    Raises
    ------
    ValueError
        If it is not an FMI 2.0 co-simulation FMU made with pythonfmu; zipfile and the XML parser raise others.
    """
    with zipfile.ZipFile(path) as file:
        names = frozenset(file.namelist())
        if (size := sum(member.file_size for member in file.infolist())) > _LARGEST:
            raise ValueError(f"it would unpack to {size} bytes, more than {_LARGEST}")
        root = ElementTree.fromstring(file.read("modelDescription.xml"))
        node = root.find("CoSimulation")
        if root.get("fmiVersion") != "2.0" or node is None:
            raise ValueError("not FMI 2.0 for co-simulation")
        if "resources/slavemodule.txt" not in names:
            raise ValueError("it holds no Python code")
        script = file.read("resources/slavemodule.txt").decode().strip()
    return Package(path, names, script, node.get("modelIdentifier", ""), root.get("guid", ""))


def ask(name: str | None = None) -> Interpreter | None:
    """Ask an interpreter (by default the one that tools use) what it has; return None if it cannot be run."""
    name = name or interpreter_name()
    command = [name, "-c", _NOT_HERE + PROBE.read_text(encoding="utf-8")]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    _, _, answers = done.stdout.partition("openpanto_probe:\n")  # what a site's own code prints comes before
    lines = [*answers.splitlines(), "", "", "", ""]
    # Without PATH it does not know where it is.
    return Interpreter(lines[0] or name, *lines[1:4]) if done.returncode == 0 and lines[1] else None


def interpreter_name() -> str:
    """Return the interpreter that tools use: what OPENPANTO_PYTHON names, or the first python3 on PATH."""
    default = "python" if platform.system() == "Windows" else "python3"
    return os.environ.get("OPENPANTO_PYTHON") or default


def _platform(package: Package) -> Iterator[Finding]:
    here = f"{platform.system()} on {platform.machine()}"
    library = package.library()
    if library in package.names:
        yield Finding("ok", f"the FMU has a library for this platform ({here})")
    else:
        have = ", ".join(sorted({n.split("/")[1] for n in package.names if n.startswith("binaries/")}))
        held = f"it holds binaries for {have} only" if have else "it holds no binaries"
        yield Finding("missing", f"the FMU has no library for this platform ({here}); {held}")


def _libraries(package: Package) -> Iterator[Finding]:
    """Compare the C library that the FMU's libraries need with this machine's."""
    name, version = platform.libc_ver()
    if name != "glibc":
        return
    here = _numbers(version)
    library = package.library()
    own = {library, library.removesuffix(".so") + INNER_SUFFIX} & package.names
    with zipfile.ZipFile(package.path) as file:
        needed = max((needed_versions(file.read(n)).get("GLIBC", (0,)) for n in own), default=(0,))
    text = ".".join(str(part) for part in needed)
    if needed > here:
        older = f"need glibc {text} or newer; this machine is older, it has {version}"
        yield Finding("missing", f"the FMU's libraries {older}")
    elif own:
        yield Finding("ok", f"the FMU's libraries need glibc {text} or newer; this machine has {version}")


def _bundled(package: Package) -> Iterator[Finding]:
    """Say what Python a standalone FMU brings, and whether this machine is too old for it."""
    if f"resources/runtime/{DESCRIPTION}" not in package.names:
        return
    with zipfile.ZipFile(package.path) as file:
        text = file.read(f"resources/runtime/{DESCRIPTION}").decode("utf-8")
    about = dict(line.split("=", 1) for line in text.splitlines() if "=" in line)
    brought = f"the FMU brings Python {about.get('python')} for {about.get('platform')}"
    name, version = platform.libc_ver()
    needed, here = (_numbers(text) for text in (about.get("glibc", "0"), version))
    if name == "glibc" and needed > here:
        yield Finding("missing", f"{brought}, which needs glibc {about['glibc']}; this machine has {version}")
    else:
        yield Finding("ok", f"{brought}, which tools that are not Python run it with")


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split(".") if part.isdigit())


def _run(package: Package) -> Iterator[Finding]:
    """Load the FMU as a run does, with this Python, in the temporary folder that a run would use."""
    if package.library() not in package.names:
        return
    place = tempfile.gettempdir()
    try:
        with tempfile.TemporaryDirectory(prefix="fmu-") as folder:
            with zipfile.ZipFile(package.path) as file:
                file.extractall(folder)
            command = [sys.executable, "-P", "-c", _RUN, folder, package.identifier, package.guid]
            done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False)
    except OSError as error:
        yield Finding(
            "missing", f"the FMU cannot be unpacked in {place} ({error.strerror}); name another folder in TMPDIR"
        )
        return
    except subprocess.TimeoutExpired:
        yield Finding("missing", f"loaded as a run does it, in {place}, the FMU made no step within {_SECONDS} s")
        return
    if done.returncode == 0:
        yield Finding("ok", f"loaded as a run does it, in {place}, the FMU was initialised and made a step")
    else:
        yield Finding("missing", f"loaded as a run does it, in {place}, the FMU fails: {_why(done)}")


def _why(done: subprocess.CompletedProcess[str]) -> str:
    if done.returncode < 0:
        return f"the process ended by signal {-done.returncode}"
    text = (done.stdout.strip().splitlines() or done.stderr.strip().splitlines() or ["no reason given"])[-1]
    if "failed to map segment" in text or "Operation not permitted" in text:
        return f"{text}; programs may not be loaded from that folder: name another one in TMPDIR"
    return text


def _python(python: Interpreter | None) -> Iterator[Finding]:
    if python is None:
        yield Finding(
            "missing",
            f"no Python found: '{interpreter_name()}' cannot be run; install Python 3.11 or newer with numpy and "
            "scipy and put it first on PATH, or name it in the environment variable OPENPANTO_PYTHON",
        )
    elif python.lack:
        yield Finding("missing", f"{python.executable} {python.lack}; {_remedy(python)}")
    else:
        yield Finding("ok", f"{python.executable} is Python {python.version} with numpy and scipy")


def _remedy(python: Interpreter) -> str:
    if "packages" in python.lack:
        return f"install them: {python.executable} -m pip install numpy scipy"
    return "name another one in the environment variable OPENPANTO_PYTHON"


def _trial(package: Package, python: Interpreter) -> Iterator[Finding]:
    with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
        with zipfile.ZipFile(package.path) as file:
            file.extractall(folder, [n for n in package.names if n.startswith("resources/")])
        resources = str(Path(folder) / "resources")
        command = [python.executable, "-c", _NOT_HERE + _TRIAL, resources, package.script, package.identifier]
        done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False)
    if done.returncode == 0:
        yield Finding("ok", "the FMU's code was initialised there and made a step")
    else:
        lines = done.stderr.strip().splitlines() or ["no reason given"]
        yield Finding("missing", f"the FMU's code does not run there: {lines[-1]}")


def _other_hosts(package: Package, python: Interpreter) -> Iterator[Finding]:
    yield Finding("ok", "tools that are Python themselves (FMPy, Ecos and libcosim from Python) can run it")
    if platform.system() == "Windows":
        yield Finding("note", f"tools that are not Python need the python3.dll of {python.executable} on PATH")
    elif not python.library:
        yield Finding(
            "missing",
            f"tools that are not Python cannot: {python.executable} has no shared library; install libpython "
            f"(Debian: apt-get install libpython{python.version}), or a Python built with --enable-shared",
        )
    elif package.has_loader:
        yield Finding("ok", f"tools that are not Python can run it too: its loader will load {python.library}")
    else:
        first = Path(python.executable).parent
        yield Finding(
            "note",
            "tools that are not Python need it built with our loader, or to be started like this: "
            f"PATH={first}:$PATH LD_PRELOAD={python.library} the-tool",
        )


def main(path: Path) -> int:
    """Print the findings on an FMU; return 1 if something is missing."""
    return show(examine(path))


def show(found: Sequence[Finding]) -> int:
    """Print findings; return 1 if something is missing."""
    for finding in found:
        print(finding)
    sys.stdout.flush()
    return 1 if any(f.level == "missing" for f in found) else 0
