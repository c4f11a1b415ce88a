"""Building FMUs: from a definition and the sources to one deterministic archive."""

from __future__ import annotations

import hashlib
import importlib
import io
import json
import os
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, indent, tostring

import pythonfmu

from fmus.builder.fmu_page import About, page
from fmus.builder.icon import icon
from fmus.builder.source_bundle import BundleError, Module, collect, rewrite
from fmus.loader.loader_build import DESCRIPTION, LoaderError, sources, with_loader, with_windows_loader
from fmus.loader.pythonfmu_repair import repaired

REPOSITORY = Path(__file__).resolve().parents[2]
LIBRARY = REPOSITORY / "models" / "library"
PYTHONFMU = Path(pythonfmu.__file__).resolve().parent
#: Packages that are carried inside an FMU; pythonfmu too, for another FMU may bring another version of it.
ROOTS: Mapping[str, Path] = {
    "models": REPOSITORY / "models",
    "fmus": REPOSITORY / "fmus",
    "pythonfmu": PYTHONFMU,
}
_EMPTIED = frozenset({"pythonfmu"})
#: The earliest time a zip archive can hold: the same for every file, so that builds are identical.
_ZIP_DATE = (1980, 1, 1, 0, 0, 0)
#: Kind of pantograph, as its definition says -> module and class of the adapter.
_PANTOGRAPHS: Mapping[str, tuple[str, str]] = {
    "lumped": ("fmus.slave.lumped_slave", "LumpedPantographSlave"),
    "multibody": ("fmus.slave.multibody_slave", "MultibodyPantographSlave"),
}
#: Sources that are not carried along but decide about an FMU's bytes.
_BUILDERS = (
    "builder/fmu_build.py",
    "builder/source_bundle.py",
    "builder/fmu_page.py",
    "builder/icon.py",
    "loader/pythonfmu_repair.py",
)
_REQUIREMENTS = b"numpy>=1.26\nscipy>=1.11\n"
#: Most pantograph ports of a line: each costs variables, and no train has more.
MAX_PORTS = 16
_PLATFORMS = {".so": "linux64", ".dll": "win64", ".dylib": "darwin64"}
#: In every FMU of ours: what it is, for the loader and for whoever wants to know whether it may be replaced.
MARK = "resources/openpanto.txt"
DESCRIPTION_XML = "modelDescription.xml"
#: Where a standalone FMU holds its own Python.
RUNTIME = "resources/runtime"

_SCRIPT = '''"""Entry for pythonfmu. Generated; the name of this file holds the content hash."""

{imports}
from {package}.fmus.slave.adapter import hold
from {package}.{module} import {base}

hold(globals())


class {name}({base}):
    """The adapter, with what is special about this FMU."""

    fingerprint = "{fingerprint}"
    description = {title!r}
{settings}

# pythonfmu runs this for every instance, and never gives the class back: so they share the first.
{name} = globals().setdefault("first", {name})
'''


class BuildError(ValueError):
    """An FMU that cannot be built; says which and why."""


class UnknownFmuError(BuildError):
    """No FMU of this name; lists those that there are."""


@dataclass(frozen=True)
class Recipe:
    """What an FMU is made of.

    Attributes
    ----------
    name : str
        Model name and name of the file, a Python identifier.
    title : str
        One line for users.
    module, base : str
        The adapter: a subclass of ``Adapter`` and its module.
    definition : Path
        File that becomes ``resources/definition.toml``.
    settings : mapping
        Class attributes of the adapter.
    roots : mapping
        Packages that are carried along, and their folders.
    is_own : bool
        Whether the definition is a file of the user's, not of the library: the FMU remembers where it lay.
    """

    name: str
    title: str
    module: str
    base: str
    definition: Path
    settings: Mapping[str, int] = field(default_factory=dict)
    roots: Mapping[str, Path] = field(default_factory=lambda: ROOTS)
    is_own: bool = False


@dataclass(frozen=True)
class _Sources:
    """All that decides about an FMU's bytes, and the hash of it."""

    modules: Mapping[str, Module]
    definition: bytes
    binaries: Mapping[str, bytes]
    licenses: Mapping[str, bytes]
    fingerprint: str

    @property
    def package(self) -> str:
        return f"openpanto_{self.fingerprint.replace('-', '')[:12]}"


def known_names() -> list[str]:
    """Return the names of all FMUs that the library has definitions for."""
    lines = [f"Catenary_{path.stem}" for path in _definitions("lines")]
    files = _definitions("pantographs")
    pantographs = [f"Pantograph_{path.stem}" for path in files if _head(path).get("type") in _PANTOGRAPHS]
    return lines + pantographs


def recipe(name: str, pantographs: int | None = None) -> Recipe:
    """Return how to make the FMU of a name.

    Parameters
    ----------
    name : str
        ``Catenary_LINE``, ``Catenary_LINE_P2`` for two pantograph ports, ``Pantograph_NAME``, or the path of a
        definition: ``path/to/LINE.toml``.
    pantographs : int, optional
        Number of pantograph ports of a line; the name gets the suffix ``_Pn``.

    Raises
    ------
    UnknownFmuError
        If the library has no definition for it.
    BuildError
        If the file is not there, or is no definition.
    """
    if name.lower().endswith(".toml"):
        return _own_recipe(Path(name), pantographs or 1)
    kind, _, rest = name.partition("_")
    stem, ports = _split_ports(rest, pantographs)
    if kind == "Catenary" and (path := _definition("lines", stem)) is not None:
        suffix = f"_P{ports}" if ports > 1 else ""
        return Recipe(
            f"Catenary_{stem}{suffix}",
            _head(path).get("title") or f"Overhead contact line {stem}",
            "fmus.slave.catenary_slave",
            "CatenarySlave",
            path,
            {"pantographs": ports},
        )
    path = _definition("pantographs", rest) if kind == "Pantograph" else None
    if path is not None and (adapter := _PANTOGRAPHS.get(_head(path).get("type", ""))):
        return Recipe(name, _head(path).get("title") or f"Pantograph {rest}", *adapter, path)
    known = ", ".join(known_names()) or "none"
    raise UnknownFmuError(f"There is no FMU '{name}'; known are {known} (and NAME_P2: a line for two pantographs).")


def _own_recipe(path: Path, ports: int) -> Recipe:
    """Return how to make the FMU of a user's definition; its file name gives the FMU's."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BuildError(f"{path} cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise BuildError(f"{path} is not a TOML file ({error})") from error
    stem, kind = path.stem, data.get("type")
    if not (stem.isascii() and stem.replace("_", "a").isalnum()):
        raise BuildError(f"{path}: the FMU gets the file's name, which may hold letters, digits and _ only")
    title = data.get("title") if isinstance(data.get("title"), str) else ""
    if isinstance(kind, str) and kind in _PANTOGRAPHS:
        if ports > 1:
            raise BuildError(f"{path} is a pantograph; only lines have pantograph ports")
        return Recipe(f"Pantograph_{stem}", title or f"Pantograph {stem}", *_PANTOGRAPHS[kind], path, is_own=True)
    if "spans" in data or "contact_wire" in data:
        suffix = f"_P{ports}" if ports > 1 else ""
        line = title or f"Overhead contact line {stem}"
        name, settings = f"Catenary_{stem}{suffix}", {"pantographs": ports}
        return Recipe(name, line, "fmus.slave.catenary_slave", "CatenarySlave", path, settings, is_own=True)
    kinds = " or ".join(f"'{name}'" for name in _PANTOGRAPHS)
    raise BuildError(f"{path} defines neither a line (no [spans]) nor a pantograph (type {kinds})")


def fingerprint(wanted: Recipe) -> str:
    """Return the content hash of an FMU, its GUID, without building it."""
    return _gather(wanted).fingerprint


def build(wanted: Recipe, folder: Path, loader: bool = True, runtime: Mapping[str, bytes] | None = None) -> Path:
    """Write ``folder/NAME.fmu`` and return its path; other builds may run at the same time.

    Parameters
    ----------
    wanted : Recipe
    folder : Path
    loader : bool
        Whether our loader is to stand before pythonfmu's Linux library; where it cannot be had, it does not.
    runtime : mapping, optional
        The Python that the FMU is to bring along (``fmus.loader.runtime``): path -> content.

    Raises
    ------
    BuildError
        If the definition or the sources do not make an FMU, or it cannot be written.
    """
    data = archive(wanted, loader, _origin(wanted, folder), runtime)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{wanted.name}.fmu"
    try:
        _write_whole(path, data)
    except OSError as error:
        raise BuildError(f"{path} cannot be written ({error.strerror or error})") from error
    return path


def _write_whole(path: Path, data: bytes) -> None:
    """Write the file beside its place, of any process's own name there, and put it in its place when it is whole."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def archive(
    wanted: Recipe,
    loader: bool = True,
    origin: Mapping[str, str] | None = None,
    runtime: Mapping[str, bytes] | None = None,
) -> bytes:
    """Return the bytes of an FMU; the same sources give the same bytes (with the loader: and the same compiler).

    Parameters
    ----------
    wanted : Recipe
    loader : bool
        See `build`.
    origin : mapping, optional
        What the mark says about a user's definition.
    runtime : mapping, optional
        See `build`.

    Raises
    ------
    BuildError
        If the definition or the sources do not make an FMU, or a runtime has no loader to open it.
    """
    gathered = _gather(wanted)
    files = _contents(wanted, gathered)
    if runtime:
        files = _with_runtime(files, wanted.name, runtime)
    elif loader and not why_no_loader():
        files = with_loader(files, wanted.name)
    files[MARK] = _mark(gathered.fingerprint, files, origin or {})
    return _zipped(files)


def _with_runtime(files: Mapping[str, bytes], name: str, runtime: Mapping[str, bytes]) -> dict[str, bytes]:
    is_for_windows = b"\nplatform=win64\n" in runtime[DESCRIPTION]
    try:
        files = with_windows_loader(files, name) if is_for_windows else with_loader(files, name)
    except LoaderError as error:
        raise BuildError(f"{name} cannot be standalone: {error}") from error
    brought = {f"{RUNTIME}/{inner}": data for inner, data in runtime.items()}
    # pythonfmu's description asks for a tool, Python, on the machine.
    description = files[DESCRIPTION_XML].replace(b'needsExecutionTool="true"', b'needsExecutionTool="false"')
    return {**files, **brought, DESCRIPTION_XML: description}


def _zipped(files: Mapping[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    # Stored, not compressed: what a compressor makes of the same input differs between its versions. A runtime is too
    # large for that.
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as package:
        for name, data in sorted(files.items()):
            entry = zipfile.ZipInfo(name, _ZIP_DATE)
            entry.create_system = 3
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            if name.startswith(f"{RUNTIME}/"):
                package.writestr(entry, data, zipfile.ZIP_DEFLATED, 9)
            else:
                package.writestr(entry, data)
    return buffer.getvalue()


def why_no_loader() -> str:
    """Return why FMUs that are built here get pythonfmu's own library instead of our loader; empty if they do not."""
    try:
        with_loader(_binaries("X"), "X")
    except LoaderError as error:
        return str(error)
    return ""


def content_hash(files: Mapping[str, bytes]) -> str:
    """Return a SHA-256 of an FMU's files but the mark, which holds it: of an FMU that nobody changed by hand."""
    whole = hashlib.sha256()
    for name, data in sorted(files.items()):
        if name != MARK:
            whole.update(f"{name}\0{len(data)}\0".encode() + data)
    return whole.hexdigest()


def _origin(wanted: Recipe, folder: Path) -> dict[str, str]:
    """Return where a user's definition lies, seen from the FMU: so that it is known to be stale when that changes."""
    if not wanted.is_own:
        return {}
    path = wanted.definition.resolve()
    try:
        path = Path(os.path.relpath(path, folder.resolve()))
    except ValueError:  # on another drive
        return {}
    return {"definition": path.as_posix(), "pantographs": str(wanted.settings.get("pantographs", 1))}


def _mark(guid: str, files: Mapping[str, bytes], origin: Mapping[str, str]) -> bytes:
    lines = {"format": "1", "guid": guid, "content": content_hash(files), **origin}
    return "".join(f"{key}={value}\n" for key, value in lines.items()).encode()


def _definitions(folder: str) -> list[Path]:
    return sorted((LIBRARY / folder).glob("*.toml"))


def _definition(folder: str, name: str) -> Path | None:
    # Looked up, not made into a path: a name could lead out of the library, and the FMU out of its folder.
    return next((path for path in _definitions(folder) if path.stem == name), None)


def _head(path: Path) -> dict[str, str]:
    """Return the plain texts of a definition; a file that cannot be read has none, the build says why."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {"type": "lumped"}
    return {key: value for key, value in data.items() if isinstance(value, str)}


def _split_ports(text: str, pantographs: int | None) -> tuple[str, int]:
    stem, separator, number = text.rpartition("_P")
    if separator and number.isascii() and number.isdigit() and len(number) <= 2 and 0 < int(number) <= MAX_PORTS:
        return stem, pantographs or int(number)
    return text, pantographs or 1


def _gather(wanted: Recipe) -> _Sources:
    try:
        modules = collect(wanted.module, wanted.roots, _EMPTIED)
        definition = wanted.definition.read_bytes()
    except (BundleError, SyntaxError) as error:
        raise BuildError(f"{wanted.name}: {error}") from error
    except OSError as error:
        raise BuildError(f"{wanted.name}: {error.filename} cannot be read ({error.strerror})") from error
    binaries, licenses = _binaries(wanted.name), _licenses()
    pieces = {f"module/{n}": m.source.encode() for n, m in modules.items()} | binaries | licenses
    # The build itself decides about the bytes as well.
    pieces |= {"recipe": _recipe_bytes(wanted), **_builders()}
    pieces["definition"] = definition
    return _Sources(modules, definition, binaries, licenses, _hash(pieces))


def _builders() -> dict[str, bytes]:
    here = REPOSITORY / "fmus"
    files = {name: (here / name).read_bytes() for name in _BUILDERS} | sources()
    return {f"build/{name}": data for name, data in files.items()}


def _recipe_bytes(wanted: Recipe) -> bytes:
    texts = [wanted.name, wanted.title, wanted.module, wanted.base, dict(wanted.settings)]
    return json.dumps(texts, sort_keys=True).encode()


def _hash(pieces: Mapping[str, bytes]) -> str:
    """Return a SHA-256 over names and contents, cut and written as a GUID."""
    whole = hashlib.sha256()
    for name, data in sorted(pieces.items()):
        whole.update(f"{name}\0{len(data)}\0".encode() + data)
    digest = whole.hexdigest()
    return "-".join([digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]])


def _binaries(name: str) -> dict[str, bytes]:
    folder = PYTHONFMU / "resources" / "binaries"
    files = sorted(p for p in folder.rglob("*") if p.suffix in _PLATFORMS)
    return {f"binaries/{p.parent.name}/{name}{p.suffix}": repaired(p.read_bytes()) for p in files}


def _licenses() -> dict[str, bytes]:
    # An installed one first: beside installed packages a file LICENSE can be anybody's.
    own = [*_installed_licenses(REPOSITORY, "openpanto"), REPOSITORY / "LICENSE"]
    found = {"openpanto": own, "pythonfmu": _installed_licenses(PYTHONFMU.parent, "pythonfmu")}
    files = {name: next((p for p in paths if p.is_file()), None) for name, paths in found.items()}
    if lacking := [name for name, path in files.items() if path is None]:
        raise BuildError(f"the licence of {' and '.join(lacking)} is not installed; install the package again")
    return {f"documentation/licenses/{name}.txt": path.read_bytes() for name, path in files.items() if path}


def _installed_licenses(folder: Path, package: str) -> list[Path]:
    """Return the licence files of a package that was installed into a folder."""
    return sorted(p for info in folder.glob(f"{package}-*.dist-info") for p in info.rglob("LICENSE*"))


def _contents(wanted: Recipe, sources: _Sources) -> dict[str, bytes]:
    script = f"{wanted.name}_{sources.package.removeprefix('openpanto_')}"
    resources = {
        "slavemodule.txt": script.encode(),
        f"{script}.py": _script(wanted, sources).encode(),
        "definition.toml": sources.definition,
        "requirements.txt": _REQUIREMENTS,
        f"{sources.package}/__init__.py": f'"""Sources of {wanted.name}."""\n'.encode(),
    }
    try:
        for module in sources.modules.values():
            text = rewrite(module, sources.package, wanted.roots)
            resources[f"{sources.package}/{module.inner_path()}"] = text.encode()
    except BundleError as error:
        raise BuildError(f"{wanted.name}: {error}") from error
    files = {f"resources/{name}": data for name, data in resources.items()}
    files["model.png"] = icon(wanted.name.partition("_")[0].lower())
    return {**files, **_describe(wanted, sources, script, resources), **sources.binaries, **sources.licenses}


def _script(wanted: Recipe, sources: _Sources) -> str:
    # Everything is imported at once: the folder of the first of two instances may be gone later.
    names = [name for name, module in sources.modules.items() if not module.is_optional]
    imports = "\n".join(f"import {sources.package}.{name}" for name in names)
    settings = "".join(f"    {name} = {value!r}\n" for name, value in sorted(wanted.settings.items()))
    return _SCRIPT.format(
        title=wanted.title,
        imports=imports,
        package=sources.package,
        module=wanted.module,
        base=wanted.base,
        name=wanted.name,
        fingerprint=sources.fingerprint,
        settings=settings,
    )


def _describe(wanted: Recipe, sources: _Sources, script: str, resources: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return model description and page, made by the packed sources themselves: so they are known to import."""
    with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
        for name, data in resources.items():
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        with _importable(folder, (sources.package, script)):
            slave = _instance(wanted, script, folder)
            return {
                DESCRIPTION_XML: _description(slave.to_xml()),
                "documentation/index.html": _page(wanted, sources, slave),
            }


def _instance(wanted: Recipe, script: str, folder: str) -> Any:
    try:
        slave_class = getattr(importlib.import_module(script), wanted.name)
        with redirect_stderr(io.StringIO()):  # an adapter tells hosts there what is raised here as well
            return slave_class(instance_name=wanted.name, resources=folder)
    except Exception as error:
        # The user's file, not the copy of it that is gone by now.
        text = str(error).replace(str(Path(folder) / "definition.toml"), str(wanted.definition))
        raise BuildError(f"{wanted.name} cannot be built: {text}") from error


def _description(root: Element) -> bytes:
    indent(root)
    text = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _page(wanted: Recipe, sources: _Sources, slave: Any) -> bytes:
    definition = sources.definition.decode("utf-8")
    said = About(wanted.name, wanted.title, sources.fingerprint, slave.models, slave.limits, definition)
    return page(said, slave.table, slave.parameters)


@contextmanager
def _importable(folder: str, names: tuple[str, ...]) -> Iterator[None]:
    """Make a folder's modules importable for a while, and forget them afterwards: their files go away."""
    no_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        with suppress(ValueError):  # the script takes it away itself
            sys.path.remove(folder)
        sys.dont_write_bytecode = no_bytecode
        for name in [n for n in sys.modules if n.partition(".")[0] in names]:
            del sys.modules[name]
        importlib.invalidate_caches()
