"""What an FMU is made of: its recipe by name or file, all sources that decide its bytes, and their hash, the GUID."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pythonfmu

from fmus.builder.fault_list import fault_tables, split_faults
from fmus.builder.source_bundle import BundleError, Module, collect
from fmus.loader.loader_build import sources
from fmus.loader.pythonfmu_repair import repaired
from models.catenary.definition.surface_reading import CARRIED, named_profile
from models.definition_files.message_text import hint, said
from models.definition_files.toml_reader import DefinitionError, Table
from models.library import search_path
from models.library.search_path import Kind, definition_files

REPOSITORY = Path(__file__).resolve().parents[2]
LIBRARY = REPOSITORY / "models" / "library"
_ICONS = Path(__file__).resolve().parent / "icons"
PYTHONFMU = Path(pythonfmu.__file__).resolve().parent
#: Packages that are carried inside an FMU; pythonfmu too, for another FMU may bring another version of it.
ROOTS: Mapping[str, Path] = {
    "models": REPOSITORY / "models",
    "fmus": REPOSITORY / "fmus",
    "pythonfmu": PYTHONFMU,
}
#: Packages of which an FMU takes single modules: their __init__ hand out more than it needs.
EMPTIED = frozenset({"pythonfmu", "models"})
#: Kind of pantograph, as its definition says -> module and class of the adapter.
_PANTOGRAPHS: Mapping[str, tuple[str, str]] = {
    "lumped": ("fmus.slave.lumped_slave", "LumpedPantographSlave"),
    "multibody": ("fmus.slave.multibody_slave", "MultibodyPantographSlave"),
}
#: What the script of every FMU imports first.
_KEPT_CODE = "fmus.slave.kept_code"
#: Sources that are not carried along but decide about an FMU's bytes.
_BUILDERS = (
    "builder/fmu_build.py",
    "builder/recipe.py",
    "builder/signal_recipe.py",
    "builder/fault_list.py",
    "builder/source_bundle.py",
    "builder/fmu_page.py",
    "loader/pythonfmu_repair.py",
    "loader/syntax_trees.py",
)
#: Most pantograph ports of a line: each costs variables, and no train has more.
MAX_PORTS = 16
_PLATFORMS = {".so": "linux64", ".dll": "win64", ".dylib": "darwin64"}
#: In every FMU of ours: what it is, for the loader and for whoever wants to know whether it may be replaced.
MARK = "resources/openpanto.txt"
#: First part of an FMU's name, and the kind of its definition.
_PREFIXES: tuple[tuple[str, Kind], ...] = (("Catenary", "lines"), ("Pantograph", "pantographs"))


class BuildError(ValueError):
    """An FMU that cannot be built; says which and why."""


class UnknownFmuError(BuildError):
    """No FMU has this name; lists those that exist."""


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
        Whether the definition is the user's file rather than one of the library: the FMU remembers where it lay.
    added : str
        What follows the file's text in ``resources/definition.toml``.
    text : bytes or None
        What stands there in place of the file's text, where the definition is no TOML.
    resources : mapping
        More files of the folder ``resources``, by name.
    """

    name: str
    title: str
    module: str
    base: str
    definition: Path
    settings: Mapping[str, int] = field(default_factory=dict)
    roots: Mapping[str, Path] = field(default_factory=lambda: ROOTS)
    is_own: bool = False
    added: str = ""
    text: bytes | None = None
    resources: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class FmuSources:
    """All that decides about an FMU's bytes, and the hash of it."""

    modules: Mapping[str, Module]
    definition: bytes
    icon: bytes
    binaries: Mapping[str, bytes]
    licenses: Mapping[str, bytes]
    fingerprint: str

    @property
    def package(self) -> str:
        """Name of the package inside the FMU that holds the modules."""
        return f"openpanto_{self.fingerprint.replace('-', '')[:12]}"


def known_names() -> list[str]:
    """Return the names of all FMUs that the library has definitions for."""
    lines = [f"Catenary_{path.stem}" for path in _definitions("lines")]
    files = _definitions("pantographs")
    pantographs = [f"Pantograph_{path.stem}" for path in files if _head(path).get("type") in _PANTOGRAPHS]
    return lines + pantographs


def recipe(
    name: str, pantographs: int | None = None, folders: Sequence[Path] = (), built_from: Path | None = None
) -> Recipe:
    """Return how to make the FMU of a name.

    Parameters
    ----------
    name : str
        ``Catenary_LINE``, ``Catenary_LINE_P2`` for two pantograph ports, ``Pantograph_NAME``, or the path of a
        definition: ``path/to/LINE.toml``. A line's name with ``_F14`` or ``_F14F15`` lists an inactive fault for
        every dropper of these spans (of the first section, from 1), with ``_A14`` for the arms at both ends of it.
    pantographs : int, optional
        Number of pantograph ports of a line; the name gets the suffix ``_Pn``.
    folders : sequence of Path, optional
        Searched for the definition before the library (`models.library.search_path`).
    built_from : Path, optional
        Definition that such an FMU was built from: taken before the library's.

    Raises
    ------
    UnknownFmuError
        If there is no definition for it.
    BuildError
        If the file is not there, or is no definition.
    """
    if name.lower().endswith(".toml"):
        return _own_recipe(Path(name), pantographs or 1)
    plain, mark = split_faults(name, [*folders, LIBRARY])
    found = _sound_recipe(plain, pantographs, folders, built_from)
    if not mark:
        return found
    try:
        return replace(found, name=f"{found.name}_{mark}", added=fault_tables(found.definition, mark))
    except ValueError as error:
        raise BuildError(str(error)) from error


def _sound_recipe(name: str, pantographs: int | None, folders: Sequence[Path], built_from: Path | None) -> Recipe:
    """Return how to make the FMU of a name that asks for no faults; see `recipe`."""
    kind, stem, ports = _place(name, pantographs)
    if kind is not None and (own := definition_files(kind, stem, folders)):
        found = _own_recipe(own[0], ports)
        if found.name.partition("_")[0] != name.partition("_")[0]:
            raise BuildError(f"{own[0]} is no definition for {name}: it defines what {found.name} is made of")
        return found
    if built_from is not None:
        if not built_from.is_file():
            raise UnknownFmuError(f"{built_from}, which {name} was built from, is missing; check the name")
        return _own_recipe(built_from, pantographs or 1)
    path = next(iter(definition_files(kind, stem, [LIBRARY])), None) if kind is not None else None
    if path is not None and kind == "lines":
        return _line_recipe(path, _head(path).get("title", ""), ports)
    if path is not None and (adapter := _PANTOGRAPHS.get(_head(path).get("type", ""))):
        return _pantograph_recipe(path, _head(path).get("title", ""), adapter)
    if meant := [f"{prefix}_{name}" for prefix, own in _PREFIXES if definition_files(own, name, [*folders, LIBRARY])]:
        raise UnknownFmuError(f"There is no FMU '{name}'; that of the definition '{name}' is {' or '.join(meant)}.")
    known = known_names()
    text = f"There is no FMU '{name}'; known are {', '.join(known) or 'none'} (and NAME_P2: a line for two pantographs)"
    raise UnknownFmuError(text + (hint(name, known) or "."))


def doubts(name: str, folders: Iterable[Path]) -> list[str]:
    """Return what deserves a second look in the definition of an FMU's name, a sentence each; see `recipe`."""
    if name.lower().endswith(".toml"):
        return [text for text in (search_path.named_otherwise(Path(name)),) if text]
    kind, stem, _ = _place(split_faults(name, [*folders, LIBRARY])[0], None)
    return search_path.doubts(kind, stem, [*folders, LIBRARY]) if kind is not None else []


def _place(name: str, pantographs: int | None) -> tuple[Kind | None, str, int]:
    """Return where the definition of an FMU's name stands: kind, its own name, and the number of ports."""
    prefix, _, rest = name.partition("_")
    if prefix == "Catenary":
        return "lines", *_split_ports(rest, pantographs)
    return ("pantographs" if prefix == "Pantograph" else None), rest, pantographs or 1


def _line_recipe(path: Path, title: str, ports: int, is_own: bool = False) -> Recipe:
    name = f"Catenary_{path.stem}" + (f"_P{ports}" if ports > 1 else "")
    title = title or f"Overhead contact line {path.stem}"
    slave = "fmus.slave.catenary_slave", "CatenarySlave"
    settings, resources = {"pantographs": ports}, _carried(path)
    return Recipe(name, title, *slave, path, settings, is_own=is_own, resources=resources)


def _carried(path: Path) -> dict[str, bytes]:
    """Return what a line's FMU carries beside its definition, by the names that it has there."""
    profile = named_profile(path)
    try:
        return {CARRIED: profile.read_bytes()} if profile is not None else {}
    except OSError as error:
        text = f"{path}: running_surface.profile: {profile} cannot be read ({said(error)})"
        raise BuildError(text) from error


def _pantograph_recipe(path: Path, title: str, adapter: tuple[str, str], is_own: bool = False) -> Recipe:
    title = title or f"Pantograph {path.stem}"
    return Recipe(f"Pantograph_{path.stem}", title, *adapter, path, is_own=is_own)


def _own_recipe(path: Path, ports: int) -> Recipe:
    """Return how to make the FMU of a user's definition; its file name gives the FMU's."""
    try:
        data = Table.load(path).data
    except DefinitionError as error:
        raise BuildError(str(error)) from error
    if not (path.stem.isascii() and path.stem.replace("_", "a").isalnum()):
        raise BuildError(f"{path}: the FMU gets the file's name, which may hold letters, digits and _ only")
    title, kind = (text if isinstance(text := data.get(key), str) else "" for key in ("title", "type"))
    if adapter := _PANTOGRAPHS.get(kind):
        if ports > 1:
            raise BuildError(f"{path} is a pantograph; only lines have pantograph ports")
        return _pantograph_recipe(path, title, adapter, is_own=True)
    if "spans" in data or "contact_wire" in data:
        return _line_recipe(path, title, ports, is_own=True)
    kinds = " or ".join(f"'{name}'" for name in _PANTOGRAPHS)
    raise BuildError(f"{path} defines neither a line (no [spans]) nor a pantograph (type {kinds})")


def fingerprint(wanted: Recipe) -> str:
    """Return the content hash of an FMU, its GUID, without building it."""
    return gather(wanted).fingerprint


def content_hash(files: Mapping[str, bytes]) -> str:
    """Return a SHA-256 of an FMU's files except the mark, which holds it: so a change made by hand is seen."""
    return _digest({name: data for name, data in files.items() if name != MARK})


def _definitions(folder: str) -> list[Path]:
    return sorted((LIBRARY / folder).glob("*.toml"))


def _head(path: Path) -> dict[str, str]:
    """Return the plain texts of a definition; a file that cannot be read passes here, as the build says why."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return {"type": "lumped"}
    return {key: value for key, value in data.items() if isinstance(value, str)}


def _split_ports(text: str, pantographs: int | None) -> tuple[str, int]:
    stem, separator, number = text.rpartition("_P")
    if separator and number.isascii() and number.isdigit() and len(number) <= 2 and 0 < int(number) <= MAX_PORTS:
        return stem, pantographs or int(number)
    return text, pantographs or 1


def gather(wanted: Recipe) -> FmuSources:
    """Return all that decides about an FMU's bytes.

    Raises
    ------
    BuildError
        If a source is missing, or cannot be carried inside an FMU.
    """
    try:
        modules = {**collect(_KEPT_CODE, ROOTS, EMPTIED), **collect(wanted.module, wanted.roots, EMPTIED)}
        given = wanted.definition.read_bytes() if wanted.text is None else wanted.text
        definition = given + wanted.added.encode()
    except (BundleError, SyntaxError) as error:
        raise BuildError(f"{wanted.name}: {error}") from error
    except OSError as error:
        raise BuildError(f"{wanted.name}: {error.filename} cannot be read ({said(error)})") from error
    icon, binaries, licenses = _icon(wanted.name), platform_libraries(wanted.name), _licenses()
    pieces = {f"module/{n}": m.source.encode() for n, m in modules.items()} | binaries | licenses
    pieces |= {"definition": definition, "icon": icon, "recipe": _recipe_bytes(wanted)}
    pieces |= {f"resource/{name}": data for name, data in wanted.resources.items()}
    pieces |= _builders()  # the build itself decides about the bytes as well
    return FmuSources(modules, definition, icon, binaries, licenses, _guid(pieces))


def _icon(name: str) -> bytes:
    """Return the picture of a kind of FMU, 96 x 96 pixels: a line, a pantograph, or both for any other kind."""
    path = _ICONS / f"{name.partition('_')[0].lower()}.png"
    return (path if path.is_file() else _ICONS / "other.png").read_bytes()


def _builders() -> dict[str, bytes]:
    here = REPOSITORY / "fmus"
    files = {name: (here / name).read_bytes() for name in _BUILDERS} | sources()
    return {f"build/{name}": data for name, data in files.items()}


def _recipe_bytes(wanted: Recipe) -> bytes:
    texts = [wanted.name, wanted.title, wanted.module, wanted.base, dict(wanted.settings)]
    return json.dumps(texts, sort_keys=True).encode()


def _guid(pieces: Mapping[str, bytes]) -> str:
    digest = _digest(pieces)
    return "-".join([digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]])


def _digest(pieces: Mapping[str, bytes]) -> str:
    """Return a SHA-256 over names and contents."""
    whole = hashlib.sha256()
    for name, data in sorted(pieces.items()):
        whole.update(f"{name}\0{len(data)}\0".encode() + data)
    return whole.hexdigest()


def platform_libraries(name: str) -> dict[str, bytes]:
    """Return pythonfmu's own libraries, by their places in an FMU."""
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
