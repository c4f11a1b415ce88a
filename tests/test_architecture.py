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
KERNELS = ROOT / "models" / "catenary" / "kernels.py"


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
    wrong = [(str(p), name) for p in sources for name in _imports(p) if name in FORBIDDEN[package]]
    assert wrong == []


def test_physics_needs_only_numpy_and_scipy():
    import sys

    allowed = STANDARD | set(sys.stdlib_module_names)
    sources = [p for p in (ROOT / "models").rglob("*.py") if not OUTSIDE_FMU & set(p.relative_to(ROOT).parts)]
    wrong = [(str(p), name) for p in sources for name in _imports(p) if name not in allowed]
    assert wrong == [(str(KERNELS), "numba")]
