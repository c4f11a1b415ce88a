"""Statements are all found, wherever they stand."""

import ast
from pathlib import Path

import numpy
import pytest
import scipy.linalg

from fmus.loader.syntax_trees import statements

EVERYWHERE = """
async def a():
    async with b: import c1
    async for d in e:
        import c2
    else:
        import c3
class F:
    def g(self):
        try:
            import c4
        except* ValueError:
            import c5
        else:
            import c6
        finally:
            import c7
while h:
    match i:
        case [1]:
            import c8
        case _:
            import c9
else:
    for j in k: from c10 import l
"""
SOURCES = [EVERYWHERE, *(Path(m.__file__).read_text() for m in (ast, numpy, scipy.linalg, pytest))]


@pytest.mark.parametrize("source", SOURCES, ids=["everywhere", "ast", "numpy", "scipy", "pytest"])
def test_as_many_as_by_looking_into_everything(source):
    tree = ast.parse(source)
    expected = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    assert len(expected) > 5
    assert sorted(map(id, statements(tree))) == sorted(map(id, expected))
