"""What a bundled Python is taken from, and how an FMU and a host meet it."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy
import pytest
import scipy

from fmus.__main__ import main
from fmus.builder.fmu_build import build
from fmus.builder.recipe import BuildError
from fmus.builder.standalone_fmu import write_runtime
from fmus.loader import fmu_opening, loader_build
from fmus.loader.elf_library import ElfError, is_aligned, needed, soname
from fmus.loader.loader_build import with_windows_loader
from fmus.loader.python_installation import InstallationError, installed_at, own
from fmus.loader.runtime import Runtime
from fmus.loader.runtime_licences import licences
from fmus.loader.shared_libraries import collect_libraries
from tests.fmus.support import Instance, toy_recipe

VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
NAME = f"python{VERSION.replace('.', '')}.dll"
mingw = pytest.mark.skipif(
    shutil.which("x86_64-w64-mingw32-gcc") is None and os.environ.get("OPENPANTO_INTEROP") != "required",
    reason="needs mingw-w64",
)
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs Linux")


def put(root, *names, text=b""):
    for name in names:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text)


@pytest.fixture
def windows(tmp_path):
    """The skeleton of a Windows installation."""
    root = tmp_path / "Python"
    put(root, "Lib/os.py", "vcruntime140.dll", "python3.dll", "DLLs/libffi-8.dll", "LICENSE.txt")
    put(root, NAME, text=b"MZ\x00" + f"{VERSION}.4".encode() + b"\x00")
    for package in ("numpy", "scipy"):
        put(root, f"Lib/site-packages/{package}/__init__.py")
        put(root, f"Lib/site-packages/{package}/version.py", text=b'version = "9.8.7"\n')
        put(root, f"Lib/site-packages/{package}.libs/msvcp140-0123.dll")
    return root


def test_a_windows_python_is_understood_anywhere(windows):
    found = installed_at(windows)
    assert (found.platform, found.version, found.package_version("scipy")) == ("win64", f"{VERSION}.4", "9.8.7")
    libraries = collect_libraries(found, {})
    # python3.dll leads to the version's own; pythonfmu's library asks for both names.
    assert libraries.preload == ("lib/vcruntime140.dll", "lib/msvcp140.dll", "lib/python3.dll")
    assert libraries.python == f"lib/{NAME}"
    assert "packages/numpy.libs/msvcp140-0123.dll" in libraries.files


@pytest.mark.parametrize(
    ("lack", "text"),
    [
        ("", "is not a folder"),
        ("Lib/os.py", "holds no Python"),
        (NAME, f"holds no {NAME}"),
        ("Lib/site-packages/scipy", "has no scipy"),
    ],
)
def test_what_is_missing_in_a_python_is_said(windows, lack, text):
    path = windows / lack
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    with pytest.raises(InstallationError, match=text):
        installed_at(windows)


def test_a_library_of_another_version_is_refused(windows):
    put(windows, NAME, text=b"MZ\x003.1.4\x00")
    with pytest.raises(InstallationError, match="does not state its version"):
        installed_at(windows)


def test_other_versions_of_the_packages_are_refused(windows, tmp_path, capsys):
    assert main(["build", "Pantograph_CX", "--runtime", str(windows), "--out", str(tmp_path)]) == 1
    assert "has numpy 9.8.7, but what an FMU needs of it was found with" in capsys.readouterr().err


def test_a_python_without_a_shared_library_is_refused_in_one_sentence(tmp_path, capsys):
    put(tmp_path, f"lib/python{VERSION}/os.py")
    for package in ("numpy", "scipy"):
        put(tmp_path, f"lib/python{VERSION}/site-packages/{package}/__init__.py")
    assert main(["build", "Pantograph_CX", "--standalone", "--runtime", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert f"has no shared library (libpython{VERSION}.so.1.0), which a standalone FMU needs" in said
    assert "Traceback" not in said


@linux
def test_a_virtual_environment_stands_for_the_python_that_it_was_made_with(tmp_path):
    here = own()
    put(tmp_path, "pyvenv.cfg", text=f"home = {here.root}/bin\n".encode())
    for package in ("numpy", "scipy"):
        put(tmp_path, f"lib/python{VERSION}/site-packages/{package}/__init__.py")
    found = installed_at(tmp_path)
    assert (found.root, found.version, found.library) == (here.root, here.version, here.library)
    assert found.packages["numpy"].is_relative_to(tmp_path)


@linux
def test_libraries_come_with_those_that_they_need_in_order(tmp_path):
    source = own()
    modules = {f"extensions/{p.name}": p for p in source.extensions.glob("_ctypes.*.so")}
    # One in C++: libstdc++ needs libgcc_s.
    modules |= {p.name: p for p in (source.packages["scipy"] / "scipy" / "sparse").glob("_sparsetools.*.so")}
    libraries = collect_libraries(source, modules)
    names = [Path(name).name for name in libraries.preload]
    assert any(name.startswith("libffi.so") for name in names)
    for i, name in enumerate(names):
        asked = needed((libraries.files[f"lib/{name}"]).read_bytes())
        assert not set(asked) & set(names[i + 1 :])
    assert not any(name.startswith(("libc.so", "ld-linux")) for name in names)


@linux
def test_no_library_goes_without_its_licence(tmp_path):
    put(tmp_path, "libnobody.so.1")
    with pytest.raises(InstallationError, match=r"the licence of .*libnobody\.so\.1 cannot be found"):
        licences(own(), {"lib/libnobody.so.1": tmp_path / "libnobody.so.1"})


@linux
def test_a_library_tells_what_it_needs():
    library = own().library.read_bytes()
    assert soname(library).startswith(f"libpython{VERSION}")
    assert "libc.so.6" in needed(library)
    assert is_aligned(library)
    with pytest.raises(ElfError):
        needed(library[:200])
    with pytest.raises(ElfError):
        needed(b"MZ")


def test_a_folder_with_something_else_is_not_overwritten(tmp_path):
    put(tmp_path, "letter.txt")
    with pytest.raises(BuildError, match="holds files that are no runtime"):
        write_runtime(Runtime({"runtime.txt": b"format=1\n"}, "linux64", "0", True), tmp_path)


def runtime(**entries):
    settings = {"format": "1", "python": f"{VERSION}.0", "platform": "linux64", "content": "1", **entries}
    return {"runtime.txt": "".join(f"{key}={value}\n" for key, value in settings.items()).encode()}


@linux
def test_an_fmu_that_runs_in_another_python_than_its_own_says_so(tmp_path):
    fmu = build(toy_recipe(), tmp_path, runtime=runtime(python="3.99.1", numpy="0.1"))
    instance = Instance(fmu)
    said = [text for _, text in instance.messages]
    instance.free()
    assert any("the FMU brought Python 3.99.1, numpy 0.1, but runs with Python" in text for text in said)


def test_the_same_versions_or_the_same_runtime_need_no_words(monkeypatch):
    here = " ".join([platform.python_version(), numpy.__version__, scipy.__version__])
    assert fmu_opening.other_versions(here, "1") == ""
    assert "numpy 0.1" in fmu_opening.other_versions(here.replace(numpy.__version__, "0.1"), "1")
    monkeypatch.setattr(sys, "openpanto_runtime", "1", raising=False)
    assert fmu_opening.other_versions("3.99.1 0.1 0.1", "1") == ""


def test_a_runtime_without_a_loader_is_refused(monkeypatch, tmp_path):
    def none():
        raise loader_build.LoaderError("there is no C compiler for the loader")

    monkeypatch.setattr(loader_build, "loader_library", none)
    with pytest.raises(BuildError, match="cannot be standalone: there is no C compiler"):
        build(toy_recipe(), tmp_path, runtime=runtime())


@linux
@pytest.mark.parametrize(("brought", "needs"), [(None, "true"), (runtime, "false")])
def test_only_an_fmu_without_a_python_of_its_own_needs_a_tool(tmp_path, brought, needs):
    with zipfile.ZipFile(build(toy_recipe(), tmp_path, runtime=brought and brought())) as file:
        assert f'needsExecutionTool="{needs}"' in file.read("modelDescription.xml").decode()


@mingw
def test_the_loader_for_windows_has_every_function_of_fmi_for_co_simulation(tmp_path):
    stock = "binaries/win64/X.dll"
    made = with_windows_loader({stock: b"pythonfmu's"}, "X")
    assert made["binaries/win64/X.pythonfmu.dll"] == b"pythonfmu's"
    (tmp_path / "X.dll").write_bytes(made[stock])
    command = ["x86_64-w64-mingw32-objdump", "-p", str(tmp_path / "X.dll")]
    exports = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = {line.split()[-1] for line in exports.splitlines() if " fmi2" in line}
    linux_loader = loader_build.loader_library() if sys.platform.startswith("linux") else b""
    wanted = {word.decode() for word in linux_loader.split(b"\0") if word.startswith(b"fmi2") and b" " not in word}
    assert {"fmi2Instantiate", "fmi2DoStep", "fmi2GetReal", "fmi2SerializeFMUstate"} <= found
    assert wanted <= found
    assert len(found) == 34


@mingw
def test_an_fmu_with_a_windows_python_has_the_loader_there(tmp_path):
    fmu = build(toy_recipe(), tmp_path, runtime=runtime(platform="win64"))
    with zipfile.ZipFile(fmu) as file:
        names = set(file.namelist())
    assert {"binaries/win64/Toy.dll", "binaries/win64/Toy.pythonfmu.dll", "resources/runtime/runtime.txt"} <= names
    assert main(["build", "Pantograph_CX", "--no-standalone", "--runtime", str(tmp_path)]) == 1
