"""Nothing is released twice: neither pythonfmu's state when a process ends, nor a script's names when Python does."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile

import pytest

from fmus.builder.recipe import PYTHONFMU, REPOSITORY
from fmus.loader.pythonfmu_repair import repaired
from tests.effort import rest

LIBRARY = PYTHONFMU / "resources" / "binaries" / "linux64" / "libpythonfmu-export.so"
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the repair is one of the Linux library")

#: Ends without freeing what it made, as hosts do that keep FMUs loaded until the end.
_END = """
import sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from tests.fmus.support import Instance
kept = [Instance(Path(sys.argv[1]), f"part{i}") for i in range(4)]
for instance in kept:
    instance.initialise(force=1.0)
    instance.step(0.0)
if sys.argv[3] == "free":
    for instance in kept:
        instance.free()
names = [m for m in sys.modules if m.startswith("Toy_")]
count = sys.getrefcount(sys.modules[names[0]].__dict__)
print("references", count)
"""


@linux
def test_only_two_entries_of_the_dynamic_section_change():
    before, after = LIBRARY.read_bytes(), repaired(LIBRARY.read_bytes())
    assert len(before) == len(after)
    assert 1 < sum(a != b for a, b in zip(before, after, strict=True)) <= 32
    assert repaired(after) == after


@pytest.mark.parametrize("data", [b"", b"MZ...", b"\x7fELF\x02\x01" + bytes(100)])
def test_other_files_stay_as_they_are(data):
    assert repaired(data) == data


@linux
def test_an_fmu_carries_the_repaired_library(toy_fmu):
    with zipfile.ZipFile(toy_fmu) as file:
        assert file.read("binaries/linux64/Toy.pythonfmu.so") == repaired(LIBRARY.read_bytes()) != LIBRARY.read_bytes()


@linux
@pytest.mark.parametrize("ending", ["keep", *rest("free")])
def test_a_process_ends_cleanly_with_instances_freed_or_kept(toy_fmu, tmp_path, ending):
    environment = {**os.environ, "PYTHONMALLOC": "malloc", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", _END, str(toy_fmu), str(REPOSITORY), ending]
    for _ in range(2):
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[-2000:]
        assert 2 <= int(done.stdout.split()[-1]) <= 4  # none lost, none piled up by the four instances
