"""The loader: what it is compiled from, what it runs on, and that no input makes it do what C forbids."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest

from fmus.builder import fmu_build as builder
from fmus.builder.fmu_build import archive, build
from fmus.builder.recipe import fingerprint, recipe
from fmus.loader import loader_build
from fmus.loader.fmu_opening import forget, problem
from tests.fmus.support import toy_recipe

linux = pytest.mark.skipif(
    not sys.platform.startswith("linux") or shutil.which(os.environ.get("CC", "cc")) is None,
    reason="needs Linux and a C compiler (set CC, or install gcc)",
)


@linux
def test_it_runs_on_the_oldest_glibc_that_is_promised(tmp_path):
    library = tmp_path / "loader.so"
    loader_build.compile_loader(library)
    needed = loader_build.needed_versions(library.read_bytes())
    assert needed.keys() == {"GLIBC"}
    assert (2, 2) < needed["GLIBC"] <= loader_build.OLDEST_GLIBC


def test_versions_are_compared_as_numbers():
    data = b"\0GLIBC_2.9\0GLIBC_2.14\0GLIBC_2.2.5\0GLIBC_PRIVATE\0GLIBCXX_3.4.30\0GLIBCXX_3.4.9\0"
    assert loader_build.needed_versions(data) == {"GLIBC": (2, 14), "GLIBCXX": (3, 4, 30)}
    assert loader_build.needed_versions(b"no library") == {}


def test_the_guid_covers_the_sources_and_not_the_compiled_bytes(monkeypatch):
    before = fingerprint(toy_recipe())
    monkeypatch.setattr(
        "fmus.builder.fmu_build.with_loader", lambda files, _: {**files, "binaries/linux64/Toy.so": b"other"}
    )
    assert b"other" in archive(toy_recipe())
    assert fingerprint(toy_recipe()) == before
    changed = {**loader_build.sources(), "loader.c": b"int main(void) {}"}
    monkeypatch.setattr("fmus.builder.recipe.sources", lambda: changed)
    assert fingerprint(toy_recipe()) != before


def test_without_a_compiler_the_stock_library_serves_and_the_build_says_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("CC", "/nowhere/cc")
    monkeypatch.setattr(loader_build, "built_name", lambda: "none.so")
    loader_build.loader_library.cache_clear()
    try:
        assert builder.why_no_loader() == "there is no C compiler for the loader (install gcc, or set CC)"
        with zipfile.ZipFile(build(recipe("Pantograph_CX"), tmp_path)) as file:
            assert [n for n in file.namelist() if n.startswith("binaries/linux64/")] == [
                "binaries/linux64/Pantograph_CX.so"
            ]
        from fmus.__main__ import main

        assert main(["build", "Pantograph_CX", "--out", str(tmp_path)]) == 0
        assert "note: the FMUs have pythonfmu's own library only" in capsys.readouterr().err
    finally:
        loader_build.loader_library.cache_clear()
    assert fmpy.read_model_description(str(tmp_path / "Pantograph_CX.fmu")).guid == fingerprint(recipe("Pantograph_CX"))


@linux
def test_a_loader_that_does_not_compile_is_reported(monkeypatch, tmp_path):
    monkeypatch.setattr(loader_build, "_OPTIONS", ("-std=nothing",))
    with pytest.raises(loader_build.LoaderError, match=r"refused the loader: .*-std=nothing"):
        loader_build.compile_loader(tmp_path / "x.so")


def test_a_loader_that_came_with_the_package_is_taken(monkeypatch, tmp_path):
    monkeypatch.setattr(loader_build, "built_name", lambda: "loader.so")
    ready = tmp_path / "loader.so"
    ready.write_bytes(b"ready")
    monkeypatch.setattr(loader_build, "FOLDER", tmp_path)
    loader_build.loader_library.cache_clear()
    try:
        assert loader_build.loader_library() == b"ready"
    finally:
        loader_build.loader_library.cache_clear()


@linux
def test_a_loader_is_compiled_once_for_each_compiler_and_its_options(monkeypatch, tmp_path):
    compiled = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(loader_build, "built_name", lambda: "none.so")
    monkeypatch.setattr(loader_build, "compile_loader", lambda library: compiled.append(library.write_bytes(b"made")))
    try:
        for compiler in ("cc", "cc", "cp"):
            monkeypatch.setenv("CC", compiler)
            loader_build.loader_library.cache_clear()
            assert loader_build.loader_library() == b"made"
        assert len(compiled) == 2
        monkeypatch.setattr(loader_build, "_OPTIONS", ("-O1",))
        loader_build.loader_library.cache_clear()
        assert loader_build.loader_library() == b"made"
        assert len(compiled) == 3
        monkeypatch.setenv("OPENPANTO_CACHE", "off")
        loader_build.loader_library.cache_clear()
        assert loader_build.loader_library() == b"made"
        assert len(compiled) == 4
    finally:
        loader_build.loader_library.cache_clear()


# What Python is asked before pythonfmu sees the FMU.


def test_opening_leaves_no_place_to_import_from(tmp_path):
    (tmp_path / "opened_ab12.py").write_text("value = 1\n")
    before = list(sys.path)
    assert problem(str(tmp_path), "opened_ab12") == ""
    assert sys.path == before
    assert sys.modules.pop("opened_ab12").value == 1
    sys.path.insert(0, str(tmp_path))
    forget(str(tmp_path))
    assert sys.path == before


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("import scipy_of_nobody.linalg", "lacks the package scipy_of_nobody; install it there"),
        ("import openpanto_123.models", "the FMU is incomplete: No module named 'openpanto_123'"),
        ("def (:", "the FMU cannot be loaded: invalid syntax"),
        ("raise SystemExit", "the FMU cannot be loaded: SystemExit"),
        ("raise KeyboardInterrupt", "the FMU cannot be loaded: KeyboardInterrupt"),
    ],
)
def test_what_is_wrong_with_the_code_is_said(tmp_path, code, text):
    (tmp_path / "wrong_ab12.py").write_text(code)
    assert text in problem(str(tmp_path), "wrong_ab12")
    sys.modules.pop("wrong_ab12", None)


def test_a_script_that_was_cut_after_an_earlier_instance_is_found(tmp_path):
    """pythonfmu compiles the file once more, and would end Python."""
    path = tmp_path / "cut_ab12.py"
    path.write_text("value = 1\n")
    assert problem(str(tmp_path), "cut_ab12") == ""
    path.write_text("value = (\n")
    assert "the FMU cannot be loaded: '(' was never closed" in problem(str(tmp_path), "cut_ab12")
    del sys.modules["cut_ab12"]


def test_a_path_that_python_takes_for_another_needs_an_alias(tmp_path, monkeypatch):
    assert problem("no UTF-8 \udce4", "x") == "alias"
    monkeypatch.setattr("fmus.loader.fmu_opening.os.fsencode", lambda text: text.encode("latin-1"))
    assert problem("/tmp/ä", "x") == "alias"


# The whole counts.

_SANITIZERS = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")


@pytest.mark.long
@linux
def test_no_location_file_or_order_makes_it_do_what_c_forbids(tmp_path):
    """Compiled with the address and undefined-behaviour sanitizers: thousands of locations, all states of a life."""
    library = tmp_path / "loader.so"
    loader_build.compile_loader(library, _SANITIZERS)
    with zipfile.ZipFile(build(recipe("Pantograph_CX"), tmp_path)) as file:
        file.extractall(tmp_path / "fmu")
    binary = tmp_path / "fmu" / "binaries" / "linux64" / "Pantograph_CX.so"
    shutil.copy(library, binary)
    headers = Path(importlib.util.find_spec("fmpy").origin).parent / "c-code"
    host = tmp_path / "host"
    source = Path(__file__).parent / "strange_host.c"
    command = [os.environ.get("CC", "cc"), "-std=gnu11", "-Wall", *_SANITIZERS, f"-I{headers}", str(source)]
    subprocess.run([*command, "-o", str(host), "-ldl"], check=True)
    guid = fingerprint(recipe("Pantograph_CX"))
    environment = {
        **{k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "LD_"))},
        "OPENPANTO_PYTHON": sys.executable,
        "ASAN_OPTIONS": "detect_leaks=0",  # Python keeps much until the end
        "OMP_NUM_THREADS": "1",
    }
    orders = [host, binary, guid, tmp_path / "fmu" / "resources"]
    done = subprocess.run(orders, env=environment, capture_output=True, text=True, errors="replace", check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.split() == ["refused", "5000", "lived", "20"]
    assert "runtime error" not in done.stderr
