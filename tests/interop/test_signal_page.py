"""The roof that moves by a table in docs/interoperability.md, as it stands there."""

from __future__ import annotations

import re

from fmus.__main__ import main as fmus
from master.commands.main import main
from master.ssp.archive import extract
from tests.interop.support import ROOT

PAGE = (ROOT / "docs" / "interoperability.md").read_text(encoding="utf-8")


def block(name):
    """Return the XML after the page's mark of this name."""
    return re.search(rf"<!-- {name} -->\s*```xml\n(.*?)```", PAGE, re.DOTALL)[1]


def test_the_page_s_component_connectors_and_connections_make_a_valid_scenario(packed, tmp_path, capsys):
    folder = tmp_path / "demo.ssp"
    folder.mkdir()
    extract(packed, folder)
    table = re.search(r"(    time \[s\],base.z.*?)\n\n", PAGE, re.DOTALL)[1]
    (tmp_path / "roof.csv").write_text(re.sub(r"(?m)^    ", "", table) + "\n")
    out = str(folder / "resources")
    assert fmus(["signal", str(tmp_path / "roof.csv"), "--rate", "base.z=base.vz", "--out", out]) in (0, None)
    path = folder / "SystemStructure.ssd"
    text = path.read_text(encoding="utf-8").replace("</ssd:Elements>", block("signal") + "</ssd:Elements>")
    head, tail = text.split('<ssd:Component name="pantograph"', 1)
    tail = tail.replace("</ssd:Connectors>", block("inputs") + "</ssd:Connectors>", 1)
    tail = tail.replace("</ssd:Connections>", block("wires") + "</ssd:Connections>")
    path.write_text(f'{head}<ssd:Component name="pantograph"{tail}', encoding="utf-8")
    assert main(["validate", str(folder), "--no-build"]) == 0
    assert "3 components, 18 connections" in capsys.readouterr().out
