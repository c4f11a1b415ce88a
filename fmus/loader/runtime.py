"""The Python that a standalone FMU brings along: one folder, small and complete.

It holds the Python library, the standard library as one archive of byte code, those compiled modules of Python, numpy
and scipy that runs of FMUs of every kind load, the system's libraries that these need, and the licences of all of it.
``runtime.txt`` tells the loader (``loader.c``) what lies where.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import io
import json
import marshal
import re
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

import pythonfmu

from fmus.loader.elf_library import is_aligned
from fmus.loader.loader_build import DESCRIPTION
from fmus.loader.module_rehearsal import LoadedModules, RehearsalError, rehearse
from fmus.loader.python_installation import PACKAGES, Installation, InstallationError, own
from fmus.loader.runtime_licences import COMPILED_HERE, licences
from fmus.loader.shared_libraries import BlasError, Libraries, collect_libraries
from fmus.loader.syntax_trees import statements
from models.definition_files.message_text import said

#: Version of this layout, for the loader.
FORMAT: Final = 1
#: Modules of the standard library that are included although no successful run loads them: other systems and
#: encodings need them, or errors are put into words with them.
_ALWAYS: Final = frozenset(
    {
        "_strptime",
        "bisect",
        "codecs",
        "codeop",
        "copy",
        "encodings",
        "hashlib",
        "heapq",
        "linecache",
        "ntpath",
        "numbers",
        "posixpath",
        "queue",
        "stringprep",
        "textwrap",
        "traceback",
        "tracemalloc",
    }
)
#: Compiled modules that Python does without: they would need OpenSSL or libuuid. ``hashlib`` takes ``_sha256`` etc.
_REPLACED: Final = frozenset({"_hashlib", "_ssl", "_uuid"})
#: What hashlib takes instead.
_ADDED: Final = frozenset({"_md5", "_sha1", "_sha256", "_sha512", "_sha3", "_blake2"})
#: Stand-ins for modules that would load all of scipy.linalg, scipy.sparse.linalg and numpy for the sake of a few names.
_FRONTS: Final[Mapping[str, str]] = {
    "numpy.random": "class Generator: pass\nclass RandomState: pass\n",
    "scipy._lib._array_api": """Array = object
def __getattr__(name):
    if name.startswith("__"):
        raise AttributeError(name)
    def missing(*args, **kwargs):
        raise NotImplementedError("the Python that came with the FMU has no " + name + " of scipy")
    return missing
""",
    "scipy.linalg": "from numpy.linalg import LinAlgError\n",
    "scipy.linalg.lapack": "from scipy.linalg._flapack import *\n",
    "scipy.sparse.linalg": "from scipy.sparse.linalg._dsolve import SuperLU, splu\n",
}
#: Parts of numpy that are imported as they are first used, which a short run may not do.
_LAZY: Final = re.compile(r"\b(?:np|numpy)\.(linalg|random|fft|ma|polynomial|rec|char|strings|testing)\b")
#: numpy.ma makes its docstrings from these, and insists on them.
_DOCSTRINGS_NEEDED: Final = frozenset({"packages/numpy/_core/numeric.py"})
_DOCUMENTED: Final = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
_TEST_FOLDERS: Final = frozenset({"test", "tests"})
_TEST_FILES: Final = ("test_", "conftest", "setup.py")
_ZIP_DATE: Final = (1980, 1, 1, 0, 0, 0)
_BYTE_CODE_UNCHECKED: Final = (1).to_bytes(4, "little")


class RuntimeBuildError(ValueError):
    """A runtime that cannot be made; says why."""


@dataclass(frozen=True)
class Runtime:
    """A runtime folder, as files.

    Attributes
    ----------
    files : mapping
        Path below the folder, with forward slashes -> content.
    platform : str
        ``linux64`` or ``win64``.
    content : str
        Hash of all that it was made from.
    was_tried : bool
        Whether FMUs ran with it here; another system's cannot.
    """

    files: Mapping[str, bytes]
    platform: str
    content: str
    was_tried: bool


def make_runtime(source: Installation, resources: Iterable[Path]) -> Runtime:
    """Return the runtime taken from an installation of Python, tried out if it is one of this system.

    Parameters
    ----------
    source : Installation
    resources : iterable of Path
        Unpacked ``resources`` of one FMU of every kind: their runs decide what is needed.

    Raises
    ------
    RuntimeBuildError
    """
    folders = list(resources)
    here = own()
    _check_versions(source, here)
    try:
        with tempfile.TemporaryDirectory(prefix="openpanto_") as name:
            return _smallest(source, here, folders, Path(name))
    except RehearsalError as error:
        raise RuntimeBuildError(f"an FMU does not run with the bundled Python: {error}") from error
    except OSError as error:
        raise RuntimeBuildError(f"{error.filename} cannot be read ({said(error)})") from error


def _smallest(source: Installation, here: Installation, folders: Sequence[Path], work: Path) -> Runtime:
    """Return the smallest runtime that works: other versions of numpy and scipy may be built differently."""
    compiled = work / COMPILED_HERE
    compiled.mkdir()
    used = _lazily_used(folders)
    fronts = {name: text for name, text in _FRONTS.items() if name not in used}
    with suppress(RehearsalError, BlasError):
        return _make(source, here, folders, work, fronts, compiled)
    with suppress(RehearsalError):
        return _make(source, here, folders, work, fronts, None)
    return _make(source, here, folders, work, {}, None)


def _lazily_used(folders: Iterable[Path]) -> frozenset[str]:
    texts = (path.read_text(encoding="utf-8") for folder in folders for path in folder.rglob("*.py"))
    return frozenset(f"numpy.{part}" for text in texts for part in _LAZY.findall(text))


def _make(
    source: Installation,
    here: Installation,
    folders: Sequence[Path],
    work: Path,
    fronts: Mapping[str, str],
    one_blas: Path | None,
) -> Runtime:
    loaded = rehearse(folders, work, fronts, sorted(_lazily_used(folders)))
    originals = _originals(source, here, loaded, fronts)
    libraries = collect_libraries(source, originals, one_blas)
    originals = {**originals, **libraries.files}
    content = _hash(originals, fronts)
    files = _finish(source, originals, fronts) | licences(source, originals)
    files[DESCRIPTION] = _description(source, libraries, content)
    is_of_this_system = source.platform == here.platform
    if is_of_this_system:
        _try_out(source, files, libraries, folders, work)
    return Runtime(dict(sorted(files.items())), source.platform, content, is_of_this_system)


def _check_versions(source: Installation, here: Installation) -> None:
    for package in PACKAGES:
        there, wanted = source.package_version(package), here.package_version(package)
        if there != wanted:
            raise InstallationError(
                f"{source.root} has {package} {there}, but what an FMU needs of it was found with {wanted}, which "
                f"builds the FMU; install {package}=={wanted} there"
            )


def _originals(
    source: Installation, here: Installation, loaded: LoadedModules, fronts: Iterable[str]
) -> dict[str, Path]:
    """Return the files that a runtime is made from, by their places in it (those of the archive too)."""
    found = {f"stdlib/{n}": path for n, path in _standard_library(source.modules, loaded)}
    found |= {f"extensions/{path.name}": path for path in _python_extensions(source, loaded)}
    for package in PACKAGES:
        files = loaded.of_package(package, here.packages[package].resolve())
        found |= {f"packages/{n}": path for n, path in _package_files(source, package, files, fronts)}
    return found


def _standard_library(folder: Path, loaded: LoadedModules) -> Iterator[tuple[str, Path]]:
    """Yield the modules that were loaded, packages whole."""
    wanted = {name.partition(".")[0] for name in loaded.files} | _ALWAYS
    for entry in sorted(folder.iterdir()):
        if entry.stem in wanted and (entry.is_dir() or entry.suffix == ".py"):
            for path in sorted(entry.rglob("*.py")) if entry.is_dir() else [entry]:
                inner = path.relative_to(folder)
                if not _TEST_FOLDERS.intersection(inner.parts):
                    yield inner.as_posix(), path


def _python_extensions(source: Installation, loaded: LoadedModules) -> Iterator[Path]:
    wanted = (set(loaded.files) | _ADDED) - _REPLACED
    for path in sorted(source.extensions.iterdir()):
        if path.suffix in (".so", ".pyd") and path.name.partition(".")[0] in wanted:
            yield path


def _package_files(
    source: Installation, package: str, files: Iterable[Path], fronts: Iterable[str]
) -> Iterator[tuple[str, Path]]:
    """Yield the files that were loaded, and all other Python files of their folders, except behind a front."""
    root = source.packages[package]
    behind = {Path(name.replace(".", "/")) for name in fronts}
    folders = {file.parent for file in files if file.suffix == ".py"} - behind
    python = {path for folder in folders for path in (root / folder).glob("*.py")}
    python |= {root / file for file in files if file.suffix == ".py"}
    for path in sorted(python):
        if not path.name.startswith(_TEST_FILES):
            yield path.relative_to(root).as_posix(), path
    for file in files:
        if file.suffix != ".py":
            path = _compiled_module(root, file)
            yield path.relative_to(root).as_posix(), path


def _compiled_module(root: Path, file: Path) -> Path:
    stem = file.name.partition(".")[0]
    for path in sorted((root / file.parent).glob(f"{stem}.*")):
        if path.suffix in (".so", ".pyd"):
            return path
    raise InstallationError(f"{root / file.parent} has no compiled module {stem}, which FMUs load here")


def _standard_archive(source: Installation) -> str:
    """Return where the standard library lies: where Python looks for it as it starts."""
    name = f"python{source.minor_version.replace('.', '')}.zip"
    return name if source.platform == "win64" else f"lib/{name}"


def _search_path(source: Installation) -> tuple[str, ...]:
    return (_standard_archive(source), "extensions", "packages")


def _finish(source: Installation, originals: Mapping[str, Path], fronts: Mapping[str, str]) -> dict[str, bytes]:
    standing_in = {f"packages/{_inner(name, originals)}": text.encode() for name, text in fronts.items()}
    files: dict[str, bytes] = {}
    for name, path in originals.items():
        if name.startswith("stdlib/"):
            continue
        if name.endswith(".py"):
            files[f"{name}c"] = _byte_code(name, standing_in.get(name) or path.read_bytes())
        else:
            files[name] = _stripped(path)
    files[_standard_archive(source)] = _archive({n: p for n, p in originals.items() if n.startswith("stdlib/")})
    return files


def _inner(module: str, files: Iterable[str]) -> str:
    stem = module.replace(".", "/")
    return f"{stem}/__init__.py" if f"packages/{stem}/__init__.py" in files else f"{stem}.py"


def _byte_code(name: str, source: bytes) -> bytes:
    """Return a module's byte code, which is never compared with a source (PEP 552)."""
    tree = ast.parse(source) if name in _DOCSTRINGS_NEEDED else _without_docstrings(source)
    code = compile(tree, name, "exec", dont_inherit=True, optimize=0)
    # Twice: what marshal writes depends on who else holds an object, which nobody does of a fresh copy.
    body = marshal.dumps(marshal.loads(marshal.dumps(code)))
    return importlib.util.MAGIC_NUMBER + _BYTE_CODE_UNCHECKED + importlib.util.source_hash(source) + body


def _without_docstrings(source: bytes) -> ast.Module:
    """Return a module's syntax tree without docstrings, a sixth of its byte code; assertions stay."""
    tree = ast.parse(source)
    for node in [tree, *statements(tree)]:
        if isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            node.body[:1] = [ast.copy_location(ast.Pass(), node.body[0])] if len(node.body) == 1 else []
    return tree


def _archive(modules: Mapping[str, Path]) -> bytes:
    buffer = io.BytesIO()
    # Stored: it is compressed with the FMU, and Python starts faster.
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, path in sorted(modules.items()):
            inner = name.removeprefix("stdlib/")
            archive.writestr(zipfile.ZipInfo(f"{inner}c", _ZIP_DATE), _byte_code(inner, path.read_bytes()))
    return buffer.getvalue()


def _stripped(path: Path) -> bytes:
    """Return a library without the symbols that only debuggers read, as it is where there is no strip."""
    tool = shutil.which("strip")
    if tool is None or ".so" not in path.name:
        return path.read_bytes()
    with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
        out = Path(folder) / path.name
        done = subprocess.run([tool, "--strip-unneeded", "-o", out, path], capture_output=True, check=False)
        stripped = out.read_bytes() if done.returncode == 0 else b""
    # Libraries in wheels were rearranged by their makers, which strip does not always survive.
    return stripped if stripped and is_aligned(stripped) else path.read_bytes()


def _description(source: Installation, libraries: Libraries, content: str) -> bytes:
    entries = {
        "format": str(FORMAT),
        "platform": source.platform,
        "python": source.version,
        **{name: source.package_version(name) for name in PACKAGES},
        "glibc": libraries.glibc,
        "libpython": libraries.python,
        "home": ".",
        "path": ":".join(_search_path(source)),
        "preload": ":".join(libraries.preload),
        "binding": f"pythonfmu-{pythonfmu.__version__}",
        "content": content,
    }
    return "".join(f"{key}={value}\n" for key, value in entries.items() if value).encode()


def _hash(originals: Mapping[str, Path], fronts: Mapping[str, str]) -> str:
    whole = hashlib.sha256(json.dumps([FORMAT, dict(fronts)], sort_keys=True).encode())
    for name, path in sorted(originals.items()):
        whole.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\0".encode())
    return whole.hexdigest()[:32]


def write_files(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files, named by their paths with forward slashes, below a folder."""
    for name, data in files.items():
        path = folder / PurePosixPath(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        _replace(path, data)


def _replace(path: Path, data: bytes) -> None:
    """Replace a file as a whole; an error names it."""
    temporary = path.with_name(f".{path.name}.part")
    try:
        temporary.write_bytes(data)
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def _try_out(
    source: Installation, files: Mapping[str, bytes], libraries: Libraries, folders: Sequence[Path], work: Path
) -> None:
    place = work / "runtime"
    shutil.rmtree(place, ignore_errors=True)
    write_files(files, place)
    search_path = [place / name for name in _search_path(source)]
    preload = [place / name for name in libraries.preload]
    rehearse(folders, work, imports=sorted(_lazily_used(folders)), search_path=search_path, preload=preload)
