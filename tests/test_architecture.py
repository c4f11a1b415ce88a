"""The one rule: models <- fmus; master meets the physics only through .fmu files."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FORBIDDEN = {
    "models": {"fmus", "master", "fmpy", "pythonfmu", "lxml", "xml"},
    "fmus": {"master"},
    "master": {"models", "fmus", "pythonfmu"},
}
#: What runs inside an FMU may need numpy and scipy only; the commands run outside.
OUTSIDE_FMU = {"commands", "__main__.py"}
STANDARD = {"numpy", "scipy", "models"}
#: The one module that is only loaded where numba is installed.
KERNELS = ROOT / "models" / "catenary" / "step" / "step_kernels.py"


#: The physics' own command ``couple`` evaluates a record with the master's functions: those that need numpy alone.
SHARED = {f"master.evaluation.{name}" for name in ("filters", "contact_quality")}
COMMANDS = ROOT / "models" / "commands"


def _modules(path):
    """Full names of the modules that a file imports from."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module


def _imports(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module.split(".")[0]


@pytest.mark.parametrize("package", sorted(FORBIDDEN))
def test_packages_import_only_what_they_may(package):
    sources = list((ROOT / package).rglob("*.py"))
    assert sources
    wrong = [
        (str(p), name)
        for p in sources
        for name in _modules(p)
        if name.split(".")[0] in FORBIDDEN[package] and not (p.is_relative_to(COMMANDS) and name in SHARED)
    ]
    assert wrong == []


def test_what_the_physics_commands_share_needs_numpy_alone():
    import sys

    files = [ROOT / f"{name.replace('.', '/')}.py" for name in SHARED]
    allowed = {"numpy", "master.arrays", *SHARED}
    wrong = [
        (str(p), name)
        for p in (*files, ROOT / "master" / "arrays.py", ROOT / "master" / "__init__.py")
        for name in _modules(p)
        if name not in allowed and name.split(".")[0] not in {*sys.stdlib_module_names, "numpy"}
    ]
    assert wrong == []


def test_physics_needs_only_numpy_and_scipy():
    import sys

    allowed = STANDARD | set(sys.stdlib_module_names)
    sources = [p for p in (ROOT / "models").rglob("*.py") if not OUTSIDE_FMU & set(p.relative_to(ROOT).parts)]
    wrong = [(str(p), name) for p in sources for name in _imports(p) if name not in allowed]
    assert wrong == [(str(KERNELS), "numba")]
