"""What the documentation names exists."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NAMED = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8"))


def test_promises_name_tests():
    assert len(NAMED) > 20


@pytest.mark.parametrize(("path", "name"), NAMED)
def test_every_promise_has_its_test(path, name):
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_what_a_contributor_is_to_touch_is_there():
    """Files that CONTRIBUTING.md changes, and lines that its diffs take away or stand at, as far as they are whole."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    changed = re.findall(r"^--- (\S+)$", text, re.MULTILINE)
    assert len(changed) > 10
    assert [path for path in changed if not (ROOT / path).is_file()] == []
    for part in re.split(r"^--- ", text, flags=re.MULTILINE)[1:]:
        path, _, diff = part.partition("\n")
        source = (ROOT / path).read_text(encoding="utf-8")
        for line in re.findall(r"^-(\S.*)$", diff.partition("```")[0], re.MULTILINE):
            assert line.rpartition(" = ")[2] in source, f"{path}: {line}"
