"""What an FMU carries besides its code: a page, an icon, licences, its definition, its requirements."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from html.parser import HTMLParser

import pytest

from fmus.builder.fmu_build import archive
from fmus.builder.fmu_page import rows
from fmus.builder.recipe import gather, recipe
from fmus.slave.ports import Signal
from tests.fmus.support import toy_recipe


@pytest.fixture(scope="module", params=["Catenary_LN2", "Pantograph_CX"])
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("fmu") / f"{request.param}.fmu"
    path.write_bytes(archive(recipe(request.param)))
    with zipfile.ZipFile(path) as file:
        yield file


class Text(HTMLParser):
    """The text of a page, and a check that its tags are closed."""

    VOID = ("meta", "br")

    def __init__(self, page):
        super().__init__()
        self.open, self.text = [], ""
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        assert not {"src", "href"} & {name for name, _ in attributes}
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_page_names_every_port_and_parameter_with_its_unit_and_source(fmu):
    text = Text(fmu.read("documentation/index.html").decode()).text
    for title in ("What it models", "Inputs", "Outputs", "Parameters", "Limits", "Running it", "Licence"):
        assert title in text
    assert "positive pushes the" in text
    assert "See the definition below." not in text
    expected = {"Table 5.2", "contact.stiffness", "N/m", "support[1 ... "} if "dropper" in text else {"Table 5.1"}
    assert all(word in text for word in expected)


def test_definition_requirements_and_licences_are_there(fmu):
    assert b"source" in fmu.read("resources/definition.toml") or b"Source" in fmu.read("resources/definition.toml")
    assert fmu.read("resources/requirements.txt").split() == [b"numpy>=1.26", b"scipy>=1.11"]
    assert b"MIT" in fmu.read("documentation/licenses/openpanto.txt")
    assert "documentation/licenses/pythonfmu.txt" in fmu.namelist()


def test_icon_is_a_png_of_its_size(fmu):
    data = fmu.read("model.png")
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    assert struct.unpack(">II", data[16:24]) == (96, 96)
    start = data.index(b"IDAT") + 4
    length = struct.unpack(">I", data[start - 8 : start - 4])[0]
    raw = zlib.decompress(data[start : start + length])
    assert len(raw) == 96 * (96 + 1)
    assert 0.05 < 1.0 - sum(raw) / (255.0 * len(raw)) < 0.5


def test_kinds_have_icons_of_their_own():
    recipes = (recipe("Catenary_LN2"), recipe("Pantograph_CX"), toy_recipe())
    assert len({gather(wanted).icon for wanted in recipes}) == 3


def test_page_of_an_adapter_that_says_nothing():
    with zipfile.ZipFile(io.BytesIO(archive(toy_recipe()))) as file:
        assert "stiffness" in Text(file.read("documentation/index.html").decode()).text


def test_rows_join_what_differs_in_its_index_only():
    signals = [Signal(f"p[{p}].section[{s}].force", "N", "part") for p in (1, 2) for s in (1, 2, 3)]
    joined = rows([*signals, Signal("x", "m", "place", 0.5)])
    assert [(r.name, r.start) for r in joined] == [("p[1 ... 2].section[1 ... 3].force", ""), ("x", "0.5")]
