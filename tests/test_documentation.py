"""What the documentation names is there."""

import ast
import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
PAGE = TESTS.parent / "docs" / "reliability.md"
NAMED = re.findall(r"`([\w/]+\.py)::(\w+)`", PAGE.read_text(encoding="utf-8"))


def functions(path):
    return {node.name for node in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize(("file", "name"), NAMED, ids=[name for _, name in NAMED])
def test_every_test_named_in_the_reliability_page_exists(file, name):
    assert name.startswith("test_")
    assert name in functions(TESTS / file)


def test_every_promise_of_the_reliability_page_names_a_test():
    rows = [row for row in PAGE.read_text(encoding="utf-8").splitlines() if row.startswith("| ") and row[2] != "-"]
    promises = [row for row in rows if row != "| promised | shown by |"]
    assert len(promises) > 20
    assert [row for row in promises if "::" not in row] == []
