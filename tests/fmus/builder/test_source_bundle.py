"""Sources move under a private name completely, or not at all."""

from __future__ import annotations

import re
import sys
import zipfile
from pathlib import Path

import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import EMPTIED, ROOTS, recipe
from fmus.builder.source_bundle import OPTIONAL, BundleError, Module, check_rewritten, collect, rewrite

HERE = {"models": Path(), "fmus": Path()}


def moved(source: str) -> str:
    return rewrite(Module("fmus.m", Path("m.py"), source), "private", HERE)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("from models.a import b", "from private.models.a import b"),
        ("from models import b as c", "from private.models import b as c"),
        ("import models.a as b", "import private.models.a as b"),
        ("import models", "import private.models; from private import models"),
        ("import models.a", "import private.models.a; from private import models"),
        ("import os, models.a as b", "import os; import private.models.a as b"),
        ("if 1: import models.a as m; x = 1", "if 1: import private.models.a as m; x = 1"),
        ("from . import a", "from . import a"),
        ("from modelsx import a", "from modelsx import a"),
        ("é = 'ü'; from models import a", "é = 'ü'; from private.models import a"),
    ],
)
def test_every_form_of_import_is_moved(source, expected):
    assert moved(source) == expected


def test_only_the_imports_change():
    source = 'def f():\n    """See ``from models import x``."""\n    from models.a import (\n        b,\n    )\n'
    assert moved(source) == source.replace("    from models.a", "    from private.models.a")


@pytest.mark.parametrize("call", ["importlib.import_module('models.a')", "__import__('models')"])
def test_imports_that_cannot_be_moved_are_refused(call):
    with pytest.raises(BundleError, match="line 1"):
        moved(call)


def test_an_import_that_was_forgotten_is_noticed():
    with pytest.raises(BundleError, match=r"models\.definition_files\.si_units"):
        check_rewritten("def f():\n    from models.definition_files.si_units import SI\n", "m.py", HERE)


def test_relative_imports_are_followed(tmp_path):
    (tmp_path / "inner").mkdir()
    (tmp_path / "__init__.py").write_text("")
    (tmp_path / "inner" / "__init__.py").write_text("from ..other import x")
    (tmp_path / "inner" / "a.py").write_text("from . import b\nfrom .. import third")
    for name in ("inner/b", "other", "third", "unused"):
        (tmp_path / f"{name}.py").write_text("x = 1")
    assert set(collect("p.inner.a", {"p": tmp_path})) == {
        "p", "p.inner", "p.inner.a", "p.inner.b", "p.other", "p.third",
    }  # fmt: skip


def test_what_an_fmu_does_not_carry_is_named(tmp_path):
    (tmp_path / "__init__.py").write_text("import math\nimport numpy\nimport rich.table\n")
    with pytest.raises(BundleError, match=r"line 3: imports rich\.table"):
        collect("p", {"p": tmp_path})


def test_the_adapter_can_be_packed():
    modules = collect("fmus.slave.adapter", ROOTS, EMPTIED)
    assert {"models.definition_files.parameter", "fmus.slave.saved_state", "pythonfmu.fmi2slave"} <= modules.keys()
    assert not {"fmus.builder.fmu_build", "pythonfmu.builder"} & modules.keys()
    for module in modules.values():
        check_rewritten(rewrite(module, "private", ROOTS), module.name, ROOTS)


@pytest.mark.parametrize("name", ["Catenary_CA160", "Pantograph_CX"])
def test_an_fmu_is_built_without_what_is_optional(name, tmp_path, monkeypatch):
    """What it carries is imported while it is built, so no kernel may be among it, not by way of another one either."""
    for package in OPTIONAL:
        monkeypatch.setitem(sys.modules, package, None)
    assert build(recipe(name), tmp_path).is_file()


@pytest.mark.parametrize("name", ["Catenary_LN2", "Pantograph_CX", "Pantograph_generic_multibody"])
def test_an_fmu_needs_little_of_scipy(name, tmp_path):
    """What an FMU imports travels along in a standalone one: scipy.optimize alone would double its 20 MB."""
    with zipfile.ZipFile(build(recipe(name), tmp_path)) as archive:
        sources = {n: archive.read(n).decode() for n in archive.namelist() if n.endswith(".py") and "/models/" in n}
    assert len(sources) > 10
    found = set(re.findall(r"^\s*(?:from|import) (scipy[\w.]*)", "\n".join(sources.values()), re.M))
    linear = {"scipy.linalg", "scipy.linalg.blas", "scipy.linalg.lapack"}  # the first brings the other two
    sparse = {"scipy.sparse", "scipy.sparse._sparsetools", "scipy.sparse.linalg"}
    copied = {"scipy._lib.array_api_compat.numpy"}  # which all of SciPy imports, see models/scipy_start.py
    assert found <= {"scipy", *linear, *sparse, *copied}, found
