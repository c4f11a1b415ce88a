"""Sources of FMUs are compiled once on a machine, and again when they change."""

import importlib
import sys
from importlib.machinery import SourceFileLoader

import pytest

from fmus.slave.kept_code import kept_code

PACKAGE = "openpanto_toy_of_kept_code"


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    """Names of the files that Python compiles, in a cache of the test's own."""
    names, compile_source = [], SourceFileLoader.source_to_code

    def source_to_code(self, data, path, **options):
        names.append(str(path).rpartition("/")[2])
        return compile_source(self, data, path, **options)

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("OPENPANTO_CACHE", raising=False)
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.setattr(SourceFileLoader, "source_to_code", source_to_code)
    return names


def unpacked(folder, text="def place():\n    raise ValueError\n"):
    """Write the toy's sources, as an FMU's are unpacked."""
    inner = folder / PACKAGE / "inner"
    inner.mkdir(parents=True)
    for path, content in ((inner.parent / "__init__.py", ""), (inner / "__init__.py", ""), (inner / "part.py", text)):
        path.write_text(content)
    return folder


def imported(folder, monkeypatch):
    """Import the toy from a folder, as the script of an FMU does, and forget it; returns its module."""
    monkeypatch.syspath_prepend(str(folder))
    try:
        importlib.import_module(PACKAGE)
        with kept_code(PACKAGE):
            return importlib.import_module(f"{PACKAGE}.inner.part")
    finally:
        for name in [n for n in sys.modules if n.startswith(PACKAGE)]:
            del sys.modules[name]


def test_sources_unpacked_elsewhere_are_not_compiled_again(compiled, monkeypatch, tmp_path):
    imported(unpacked(tmp_path / "first"), monkeypatch)
    assert "part.py" in compiled
    compiled.clear()
    module = imported(unpacked(tmp_path / "second"), monkeypatch)
    assert "part.py" not in compiled
    # What is told of an error names the file that is there.
    assert module.place.__code__.co_filename == module.__file__ == str(tmp_path / "second" / PACKAGE / "inner/part.py")


def test_a_changed_source_of_the_same_size_and_time_is_compiled(compiled, monkeypatch, tmp_path):
    one = imported(unpacked(tmp_path / "one", "value = 1\n"), monkeypatch)
    two = imported(unpacked(tmp_path / "two", "value = 2\n"), monkeypatch)
    assert (one.value, two.value) == (1, 2)


@pytest.mark.parametrize("content", [b"", b"openpanto kept 1\n", b"x" * 4000])
def test_a_damaged_file_is_passed_over(content, compiled, monkeypatch, tmp_path):
    imported(unpacked(tmp_path / "first", "value = 1\n"), monkeypatch)
    [file] = (tmp_path / "cache/openpanto/kept").iterdir()
    file.write_bytes(content)
    assert imported(unpacked(tmp_path / "second", "value = 1\n"), monkeypatch).value == 1


def test_nothing_is_kept_without_a_cache_or_where_python_keeps_no_bytecode(compiled, monkeypatch, tmp_path):
    monkeypatch.setenv("OPENPANTO_CACHE", "off")
    imported(unpacked(tmp_path / "off", "value = 1\n"), monkeypatch)
    monkeypatch.delenv("OPENPANTO_CACHE")
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    imported(unpacked(tmp_path / "none", "value = 1\n"), monkeypatch)
    assert not (tmp_path / "cache").exists()


def test_importing_leaves_no_finder_and_no_memory_behind(compiled, monkeypatch, tmp_path):
    module = imported(unpacked(tmp_path / "first", "value = 1\n"), monkeypatch)
    assert not [place for place in sys.path_importer_cache if PACKAGE in place]
    assert not module.__loader__._compiled._files
