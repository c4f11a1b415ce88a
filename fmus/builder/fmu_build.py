"""From a recipe to one archive: the same sources give the same bytes."""

from __future__ import annotations

import importlib
import io
import os
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, suppress
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, indent, tostring

from fmus.builder.fmu_page import About, page
from fmus.builder.recipe import MARK, BuildError, FmuSources, Recipe, content_hash, gather, platform_libraries
from fmus.builder.source_bundle import BundleError, rewrite
from fmus.loader.loader_build import DESCRIPTION, LoaderError, with_loader, with_windows_loader
from models.definition_files.message_text import said

#: The earliest time a zip archive can hold: the same for every file, so that builds are identical.
_ZIP_DATE = (1980, 1, 1, 0, 0, 0)
_REQUIREMENTS = b"numpy>=1.26\nscipy>=1.11\n"
DESCRIPTION_XML = "modelDescription.xml"
#: Where a standalone FMU holds its own Python.
RUNTIME = "resources/runtime"

_SCRIPT = '''"""Entry for pythonfmu. Generated; the name of this file holds the content hash."""

from {package}.fmus.slave.kept_code import kept_code

with kept_code("{package}"):
    {imports}
    from {package}.fmus.slave.adapter import hold
    from {package}.{module} import {base}

hold(globals())


class {name}({base}):
    """The adapter, with what is particular to this FMU."""

    fingerprint = "{fingerprint}"
    description = {title!r}
{settings}

# pythonfmu runs this for every instance, and never gives the class back: so they share the first.
{name} = globals().setdefault("first", {name})
'''


def build(wanted: Recipe, folder: Path, loader: bool = True, runtime: Mapping[str, bytes] | None = None) -> Path:
    """Write ``folder/NAME.fmu`` and return its path; other builds may run at the same time.

    Parameters
    ----------
    wanted : Recipe
    folder : Path
    loader : bool
        Whether to put our loader in front of pythonfmu's Linux library, where it is to be had.
    runtime : mapping, optional
        The Python that the FMU is to bring along (``fmus.loader.runtime``): path -> content.

    Raises
    ------
    BuildError
        If the definition or the sources do not make an FMU, or it cannot be written.
    """
    data = archive(wanted, loader, _origin(wanted, folder), runtime)
    path = folder / f"{wanted.name}.fmu"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _write_atomically(path, data)
    except OSError as error:
        raise BuildError(f"{path} cannot be written ({said(error)})") from error
    return path


def _write_atomically(path: Path, data: bytes) -> None:
    """Write a file beside its place, under a name that no other process takes, and rename it once it is whole."""
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
        What the mark says about the definition.
    runtime : mapping, optional
        See `build`.

    Raises
    ------
    BuildError
        If the definition or the sources do not make an FMU, or a runtime has no loader to open it.
    """
    gathered = gather(wanted)
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
        with_loader(platform_libraries("X"), "X")
    except LoaderError as error:
        return str(error)
    return ""


def _origin(wanted: Recipe, folder: Path) -> dict[str, str]:
    """Return which definition it is, a user's relative to the FMU, which is stale once that changes."""
    if wanted.text is not None:
        return {"signal": wanted.definition.name}
    if not wanted.is_own:
        return {"library": f"{wanted.definition.parent.name}/{wanted.definition.name}"}
    path = wanted.definition.resolve()
    try:
        path = Path(os.path.relpath(path, folder.resolve()))
    except ValueError:  # on another drive
        return {}
    return {"definition": path.as_posix(), "pantographs": str(wanted.settings.get("pantographs", 1))}


def _mark(guid: str, files: Mapping[str, bytes], origin: Mapping[str, str]) -> bytes:
    lines = {"format": "1", "guid": guid, "content": content_hash(files), **origin}
    return "".join(f"{key}={value}\n" for key, value in lines.items()).encode()


def _contents(wanted: Recipe, sources: FmuSources) -> dict[str, bytes]:
    script = f"{wanted.name}_{sources.package.removeprefix('openpanto_')}"
    resources = {
        "slavemodule.txt": script.encode(),
        f"{script}.py": _script(wanted, sources).encode(),
        "definition.toml": sources.definition,
        "requirements.txt": _REQUIREMENTS,
        **wanted.resources,
        f"{sources.package}/__init__.py": f'"""Sources of {wanted.name}."""\n'.encode(),
    }
    try:
        for module in sources.modules.values():
            text = rewrite(module, sources.package, wanted.roots)
            resources[f"{sources.package}/{module.inner_path()}"] = text.encode()
    except BundleError as error:
        raise BuildError(f"{wanted.name}: {error}") from error
    files = {f"resources/{name}": data for name, data in resources.items()}
    files["model.png"] = sources.icon
    return {**files, **_describe(wanted, sources, script, resources), **sources.binaries, **sources.licenses}


def _script(wanted: Recipe, sources: FmuSources) -> str:
    # Everything is imported at once: the folder of the first of two instances may be gone later.
    names = [name for name, module in sources.modules.items() if not module.is_optional]
    imports = "\n    ".join(f"import {sources.package}.{name}" for name in names)
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


def _describe(wanted: Recipe, sources: FmuSources, script: str, resources: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return model description and page, made by the packed sources themselves, which shows that they import."""
    with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
        for name, data in resources.items():
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        with _importable(folder, (sources.package, script)):
            slave = _instance(wanted, script, folder)
            if wanted.is_own and (problem := slave.design_problem()):
                raise BuildError(f"{wanted.definition}: {problem}")
            return {
                DESCRIPTION_XML: _description(slave.to_xml()),
                "documentation/index.html": _page(wanted, sources, slave),
            }


def _instance(wanted: Recipe, script: str, folder: str) -> Any:
    try:
        slave_class = getattr(importlib.import_module(script), wanted.name)
        with redirect_stderr(io.StringIO()):  # an adapter reports there, for hosts, what it raises here
            return slave_class(instance_name=wanted.name, resources=folder)
    except Exception as error:
        # The user's file, not the copy of it that is gone by now.
        text = str(error).replace(str(Path(folder) / "definition.toml"), str(wanted.definition))
        raise BuildError(f"{wanted.name} cannot be built: {text}") from error


def _description(root: Element) -> bytes:
    indent(root)
    text = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _page(wanted: Recipe, sources: FmuSources, slave: Any) -> bytes:
    definition = sources.definition.decode("utf-8-sig")
    said = About(wanted.name, wanted.title, sources.fingerprint, slave.models, slave.limits, definition)
    return page(said, slave.table, slave.parameters)


@contextmanager
def _importable(folder: str, names: tuple[str, ...]) -> Iterator[None]:
    """Make a folder's modules importable for a while; forget them afterwards, since their files go away."""
    no_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        with suppress(ValueError):  # the script removes it itself
            sys.path.remove(folder)
        sys.dont_write_bytecode = no_bytecode
        for name in [n for n in sys.modules if n.partition(".")[0] in names]:
            del sys.modules[name]
        importlib.invalidate_caches()
