"""The documentation site builds without warnings and loads nothing from elsewhere; a step of `.ci/run`."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mkdocs", reason="the extra 'docs' is not installed")
pytest.importorskip("latex2mathml", reason="the extra 'docs' is not installed")

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    # As without ruff, which would be started for every signature, to break it into lines.
    build = "import runpy, sys; sys.modules['ruff'] = None; runpy.run_module('mkdocs', run_name='__main__')"
    command = [sys.executable, "-c", build, "build", "--strict", "--quiet", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr[-3000:]
    return {str(p.relative_to(folder)): p.read_text(encoding="utf-8") for p in folder.rglob("*.html")}


def test_nothing_is_loaded_from_elsewhere(site):
    loading = re.compile(r'<(?:script|link|img|iframe)\b[^>]*?(?:src|href)="((?:https?:)?//[^"]*)"')
    assert not {(page, url) for page, text in site.items() for url in loading.findall(text)}


def test_every_formula_is_mathml(site):
    assert sum(text.count("<math") for text in site.values()) > 100
    assert not [page for page, text in site.items() if "arithmatex" in text]


def test_generated_pages_are_there(site):
    assert "<code>youngs_modulus</code>" in site["reference/line-keys.html"]
    assert "<code>carries_weights</code>" in site["reference/pantograph-keys.html"]
    assert "python -m master validate" in site["reference/commands.html"]
    assert any(page.startswith("reference/api/models.catenary") for page in site)
