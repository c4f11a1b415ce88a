"""What is looked for in sources by their syntax trees: statements, without a look into expressions, which hold none."""

from __future__ import annotations

import ast
from collections.abc import Iterator

#: Fields in which a statement, a handler of exceptions or a case holds statements, or holders of such.
_INNER = ("body", "orelse", "finalbody", "handlers", "cases")


def statements(tree: ast.Module) -> Iterator[ast.stmt]:
    r"""Yield every statement of a module, however deep it stands, in no particular order.

    Examples
    --------
    >>> sorted(type(node).__name__ for node in statements(ast.parse("if x:\n    import y\nelse:\n    z = f(1)")))
    ['Assign', 'If', 'Import']
    """
    waiting: list[ast.AST] = [tree]
    while waiting:
        holder = waiting.pop()
        for field in _INNER:
            for inner in getattr(holder, field, ()):
                waiting.append(inner)
                if isinstance(inner, ast.stmt):
                    yield inner
