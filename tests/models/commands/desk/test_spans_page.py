"""The page of ``spans``: figure and both tables."""

import re
import xml.etree.ElementTree as ET

from models.commands.desk.spans_page import page
from models.interface.line_and_pantograph import open_line
from models.interface.line_spans import span_table


def test_the_tables_of_ca160_with_what_was_asked_for():
    line = open_line("CA160")
    found = span_table(line, pressure=961.04, limit=0.55, staggers=[(0.2, -0.2), (0.2, 0.2)], radii=[800.0])
    text = page(line.definition, found, "lines/<CA160>.toml", [("changed", "line.a = <1>")])
    rows = [re.findall(r">([^<]+)</td>", row) for row in re.findall(r"<tr[^>]*>(<td.*?)</tr>", text)]
    radius = [f"{values[60 - 25]:.0f}" for values in found.smallest_radius]
    assert ["60", *radius] in rows
    assert ["800", *(f"{values[0]:.2f}" for values in found.largest_span)] == rows[-1]
    assert ET.fromstring(re.search(r"<svg.*?</svg>", text, re.DOTALL)[0]) is not None
    assert "<CA160>" not in text
    assert "line.a = &lt;1&gt;" in text
    assert "auxiliary wire" not in text
    assert "goes with its auxiliary wire" in page(open_line("Shinkansen").definition, found, "", ())
