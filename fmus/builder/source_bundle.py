"""Source packages, packed under a private name.

FMUs in one process share ``sys.modules``: a module named ``models`` would be taken from whichever FMU
came first. So each FMU carries what it needs, and no more, inside one package whose name holds the FMU's
content hash.
"""

from __future__ import annotations

import ast
import functools
import re
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from fmus.loader.syntax_trees import statements

#: What a machine that runs an FMU must have besides Python itself.
REQUIREMENTS = ("numpy", "scipy")
#: What makes an FMU faster where it is installed: numba, and the compiler below it, which numba brings.
OPTIONAL = ("numba", "llvmlite")
_DYNAMIC_IMPORTS = {"import_module", "__import__"}
#: Stands for the private package's name until that is known.
_PACKAGE = "openpanto_private_package"


class BundleError(ValueError):
    """Sources that cannot be packed; says which file and why."""


@dataclass(frozen=True)
class Module:
    """A source file.

    Attributes
    ----------
    name : str
        Dotted, as imported (``models.definition_files.si_units``).
    path : Path
    source : str
    """

    name: str
    path: Path
    source: str

    @property
    def is_package(self) -> bool:
        """Whether other modules lie in it."""
        return self.path.name == "__init__.py"

    @property
    def is_optional(self) -> bool:
        """Whether it needs what a machine may lack, by itself or through another of its kind.

        It is then carried along, but not imported by name.
        """
        return self.name.endswith("_kernels")

    def inner_path(self) -> str:
        """Return where the file belongs below the private package, with forward slashes."""
        stem = self.name.replace(".", "/")
        return f"{stem}/__init__.py" if self.is_package else f"{stem}.py"


def collect(start: str, roots: Mapping[str, Path], emptied: frozenset[str] = frozenset()) -> dict[str, Module]:
    """Return a module and all that it imports, directly or not, from the given packages.

    Parameters
    ----------
    start : str
        Dotted name of the module to begin with.
    roots : mapping
        Package name -> its folder.
    emptied : frozenset of str
        Packages whose ``__init__`` is to be left empty.

    Raises
    ------
    BundleError
        If a module is missing, or imports what a machine with only ``REQUIREMENTS`` does not have.
    """
    found: dict[str, Module] = {}
    waiting = [start]
    while waiting:
        name = waiting.pop()
        for part in _with_parents(name):
            if part not in found:
                found[part] = _load(part, roots, emptied)
                waiting += _own_imports(found[part], roots)
    return dict(sorted(found.items()))


def rewrite(module: Module, package: str, roots: Mapping[str, Path]) -> str:
    """Return the module's source with every import from ``roots`` moved below ``package``.

    Raises
    ------
    BundleError
        If an import cannot be moved.

    Examples
    --------
    >>> rewrite(Module("m", Path("m.py"), "from models.numerics import newmark"), "private", {"models": Path()})
    'from private.models.numerics import newmark'
    """
    return _rewritten(module, frozenset(roots)).replace(_PACKAGE, package)


@functools.lru_cache(maxsize=1024)  # many FMUs carry the same modules, each in a package of its own name
def _rewritten(module: Module, roots: frozenset[str]) -> str:
    """Return the source as `rewrite` does, moved below `_PACKAGE`."""
    lines = module.source.encode().splitlines(keepends=True)
    for node in sorted(_imports(module), key=lambda n: (n.lineno, n.col_offset), reverse=True):
        if any(_root(name) in roots for name in _imported_names(node)):
            _replace(lines, node, _PACKAGE, roots)
    text = b"".join(lines).decode()
    check_rewritten(text, str(module.path), roots)
    return text


def check_rewritten(source: str, where: str, roots: Collection[str]) -> None:
    """Raise ``BundleError`` if a source still imports from ``roots`` under their public names."""
    if not _may_import(source, frozenset(roots)) and not any(name in source for name in _DYNAMIC_IMPORTS):
        return
    tree = ast.parse(source)
    for node in statements(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            left = [name for name in _imported_names(node) if _root(name) in roots]
            if left:
                raise BundleError(f"{where}: import of {left[0]} could not be moved into the FMU")
    if not any(name in source for name in _DYNAMIC_IMPORTS):
        return
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and _called(call) in _DYNAMIC_IMPORTS:
            raise BundleError(f"{where}, line {call.lineno}: {_called(call)} cannot be moved into an FMU")


def _may_import(source: str, roots: frozenset[str]) -> bool:
    """Return whether some statement may import from ``roots``; parsing all of it takes a sixth of a build."""
    return "\\\n" in source or _imports_of(roots).search(source) is not None


@functools.cache
def _imports_of(roots: frozenset[str]) -> re.Pattern[str]:
    names = "|".join(re.escape(root) for root in sorted(roots))
    return re.compile(rf"\bfrom\s+(?:{names})\b|\bimport\b.*\b(?:{names})\b")


def _with_parents(name: str) -> list[str]:
    parts = name.split(".")
    return [".".join(parts[: i + 1]) for i in range(len(parts))]


def _load(name: str, roots: Mapping[str, Path], emptied: frozenset[str]) -> Module:
    path = _find(name, roots)
    if path is None:
        raise BundleError(f"module {name} is imported, but there is no such file")
    if name in emptied:
        return Module(name, path, '"""Only the modules that an FMU needs."""\n')
    return Module(name, path, path.read_text(encoding="utf-8"))


def _find(name: str, roots: Mapping[str, Path]) -> Path | None:
    base = roots[_root(name)].joinpath(*name.split(".")[1:])
    for candidate in (base / "__init__.py", base.with_suffix(".py")):
        if candidate.is_file():
            return candidate
    return None


def _own_imports(module: Module, roots: Mapping[str, Path]) -> list[str]:
    own: list[str] = []
    for node in _imports(module):
        for name in _absolute_names(node, module):
            if _root(name) in roots:
                own += _modules_of(node, name, roots)
            elif _root(name) not in (*REQUIREMENTS, *OPTIONAL, *sys.stdlib_module_names):
                raise BundleError(
                    f"{module.path}, line {node.lineno}: imports {name}, but an FMU may only need "
                    f"{' and '.join(REQUIREMENTS)}"
                )
    return own


def _modules_of(node: ast.Import | ast.ImportFrom, name: str, roots: Mapping[str, Path]) -> Iterator[str]:
    """Yield the modules behind an import: ``from package import x`` may mean a module x."""
    yield name
    if isinstance(node, ast.ImportFrom):
        for alias in node.names:
            inner = f"{name}.{alias.name}"
            if _find(inner, roots) is not None:
                yield inner


def _imports(module: Module) -> Iterable[ast.Import | ast.ImportFrom]:
    return _import_statements(module.source, str(module.path))


@functools.lru_cache(maxsize=1024)  # asked for several times a build, and many FMUs carry the same modules
def _import_statements(source: str, path: str) -> tuple[ast.Import | ast.ImportFrom, ...]:
    found = statements(ast.parse(source, path))
    return tuple(node for node in found if isinstance(node, ast.Import | ast.ImportFrom))


def _imported_names(node: ast.Import | ast.ImportFrom) -> list[str]:
    """Return the dotted names of absolute imports; none for relative ones, which move along by themselves."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module] if node.level == 0 and node.module else []


def _absolute_names(node: ast.Import | ast.ImportFrom, module: Module) -> list[str]:
    if isinstance(node, ast.Import) or node.level == 0:
        return _imported_names(node)
    parts = module.name.split(".") if module.is_package else module.name.split(".")[:-1]
    parts = parts[: len(parts) - (node.level - 1)]
    return [".".join([*parts, node.module] if node.module else parts)]


def _replace(lines: list[bytes], node: ast.Import | ast.ImportFrom, package: str, roots: Collection[str]) -> None:
    first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    start, end = node.col_offset, node.end_col_offset
    if isinstance(node, ast.ImportFrom):
        # Only its head changes, so that line numbers stay those of the source.
        head = lines[first][start:]
        moved = re.sub(rb"^from\s+", f"from {package}.".encode(), head, count=1)
        lines[first] = lines[first][:start] + moved
        return
    moved = "; ".join(_moved_import(alias, package, roots) for alias in node.names).encode()
    tail = lines[last][end:]
    lines[first : last + 1] = [lines[first][:start] + moved + tail]


def _moved_import(alias: ast.alias, package: str, roots: Collection[str]) -> str:
    named = f" as {alias.asname}" if alias.asname else ""
    if _root(alias.name) not in roots:
        return f"import {alias.name}{named}"
    if alias.asname:
        return f"import {package}.{alias.name}{named}"
    # ``import models.x`` binds ``models``.
    return f"import {package}.{alias.name}; from {package} import {_root(alias.name)}"


def _root(name: str) -> str:
    return name.partition(".")[0]


def _called(node: ast.Call) -> str:
    function = node.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
