"""Lines as long as one likes, for benchmarks."""

from __future__ import annotations

import re
import tomllib

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.line_reading import read
from models.definition_files.toml_reader import Table
from models.library.catalogue import line_path

#: Length of a span [m].
SPAN = 50.0


def long_line_file(spans: int) -> str:
    """Return the definition file of LN2 with ``spans`` equal spans."""
    rule = f'[spans]\nstart = [0, "m", "benchmark"]\ncount = {spans}\nlength = [{SPAN}, "m", "benchmark"]\n'
    text = line_path("LN2").read_text(encoding="utf-8")
    return re.sub(r"\[spans\]\n.*?(?=\n\[)", rule, text, count=1, flags=re.DOTALL)


def ring_file(spans: int) -> str:
    """Return the definition file of LN2 with ``spans`` equal spans that close on themselves."""
    text = long_line_file(spans).replace("[spans]\n", "[spans]\nperiodic = true\n", 1)
    return re.sub(r"\[ends\]\n.*?\n(?=\[)", "", text, count=1, flags=re.DOTALL)


def ring(spans: int) -> CatenaryDefinition:
    """Return LN2 with ``spans`` equal spans that close on themselves."""
    return read(Table.from_dict(tomllib.loads(ring_file(spans)), "benchmark"))


def long_line(spans: int) -> CatenaryDefinition:
    """Return LN2 with ``spans`` equal spans."""
    return read(Table.from_dict(tomllib.loads(long_line_file(spans)), "benchmark"))
