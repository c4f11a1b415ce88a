"""What the package says of itself agrees, and what it consists of is all in the wheel."""

from __future__ import annotations

import re
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = ("models", "fmus", "master", "ssp_scenarios")
#: Files beside the code that an installed package can do without.
NOT_SHIPPED = ("*.fmu", "*.pyc", "*.so", "*.dll")


def test_citation_names_this_version_and_licence():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    found = dict(re.findall(r"^(\w[\w-]*): (.+)$", text, re.MULTILINE))
    assert found["version"] == PROJECT["project"]["version"]
    assert found["license"] == PROJECT["project"]["license"] == "MIT"
    assert found["title"] == PROJECT["project"]["name"]


def test_licence_files_are_there():
    for name in PROJECT["project"]["license-files"]:
        assert "MIT" in (ROOT / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("package", PACKAGES[:3])
def test_types_are_announced(package):
    assert (ROOT / package / "py.typed").is_file()


def test_every_file_of_the_packages_is_shipped():
    """A file that no pattern covers works in the repository and is missing after installation."""
    declared = PROJECT["tool"]["setuptools"]["package-data"]
    patterns = [f"*/{p}" for p in declared["*"]]
    for package, names in declared.items():
        if package != "*":
            patterns += [f"{package.replace('.', '/')}/{name}".replace("**/", "*") for name in names]
    files = [p for package in PACKAGES for p in (ROOT / package).rglob("*") if p.is_file() and p.suffix != ".py"]
    names = [p.relative_to(ROOT).as_posix() for p in files if "__pycache__" not in p.parts]
    assert len(names) > 60
    left_out = [n for n in names if not any(fnmatch(n, p) for p in (*patterns, *NOT_SHIPPED))]
    assert not [n for n in left_out if "/resources/" not in n]
