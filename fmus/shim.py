"""The native door that FMUs get with ``python -m fmus build --shim``, for hosts that are not Python themselves.

See ``native/shim.c``. It is compiled where the FMU is built, so its bytes depend on the compiler; FMUs without it do
not. The GUID is the same with and without: it is the same model.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

NATIVE: Final = Path(__file__).resolve().parent / "native"
PROBE: Final = NATIVE / "probe.py"
SHIM: Final = NATIVE / "shim.c"
#: What pythonfmu's own library is called behind the shim.
INNER_SUFFIX: Final = ".pythonfmu.so"
_FOLDER: Final = "binaries/linux64"
_OPTIONS: Final = ("-shared", "-fPIC", "-O2", "-fvisibility=hidden", "-Wall", "-s")


class ShimError(ValueError):
    """The shim cannot be made here; says why."""


def with_shim(binaries: Mapping[str, bytes], name: str) -> dict[str, bytes]:
    """Return an FMU's binaries with the shim in front of the Linux library.

    Raises
    ------
    ShimError
        If there is no compiler, or this is not Linux.
    """
    outer, inner = f"{_FOLDER}/{name}.so", f"{_FOLDER}/{name}{INNER_SUFFIX}"
    if outer not in binaries:
        raise ShimError(f"there is no {outer} that the shim could stand before")
    return {**binaries, inner: binaries[outer], outer: compile_shim()}


def compile_shim() -> bytes:
    """Return the shim's library, made by the C compiler in ``CC`` (cc by default).

    Raises
    ------
    ShimError
    """
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        raise ShimError("the shim can be built on Linux (x86-64) only; build without --shim")
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        raise ShimError("there is no C compiler for the shim (set CC, or install gcc); build without --shim")
    with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
        (Path(folder) / "probe.h").write_text(f"#define PROBE {json.dumps(probe_text())}\n", encoding="utf-8")
        library = Path(folder) / "shim.so"
        command = [compiler, *_OPTIONS, f"-I{folder}", str(SHIM), "-o", str(library), "-ldl", "-lpthread"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise ShimError(f"the C compiler refused the shim: {done.stderr.strip()}")
        return library.read_bytes()


def probe_text() -> str:
    """Return the questions that are asked of a Python, as an argument of ``python -c``."""
    text = PROBE.read_text(encoding="utf-8")
    if "'" in text or "\\" in text:
        raise ShimError(f"{PROBE.name} must do without single quotes and backslashes")
    return text
