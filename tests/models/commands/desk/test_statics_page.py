"""The page of ``statics``: whole, sealed, with all that was asked for, and nothing taken for markup that is not."""

import csv
import dataclasses
import html
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import pytest

from models.catenary.definition.condition_definition import Irregularity
from models.commands.desk.statics_page import conditions
from tests.models.commands.conftest import NASTY

VOID = {"meta", "link", "br"}


class Reader(HTMLParser):
    """Elements that are closed as they were opened, identifiers, links, and the text of cells."""

    def __init__(self):
        super().__init__()
        self.open, self.keys, self.links, self.tags = [], [], [], []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.tags.append(tag)
        self.keys += [given["id"]] if "id" in given else []
        self.links += [given["href"]] if "href" in given else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag


@pytest.fixture(scope="module")
def page(statics_folder):
    return (statics_folder / "statics.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def read(page):
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    return reader


def test_the_page_is_whole_and_asks_nothing_of_the_network(page, read):
    assert "script" not in read.tags
    assert "img" not in read.tags
    assert "default-src 'none'" in page
    assert set(re.findall(r"https?://[^'\" ]+", page)) == {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert all(link.startswith(("#", "data:")) for link in read.links)


def test_every_name_is_there_once_and_every_link_arrives(read):
    assert len(read.keys) == len(set(read.keys))
    assert {link[1:] for link in read.links if link.startswith("#")} <= set(read.keys)


def test_text_from_a_file_stays_text(page):
    assert "<b>A-4" not in page
    assert html.escape(NASTY) in page


def test_drawings_are_sound_and_their_letters_are_letters(page):
    drawn = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(drawn) == 7
    for each in drawn:
        assert ET.fromstring(each).get("viewBox")
    assert any("position along the track [m]" in each for each in drawn)


def test_verdicts_come_first_what_is_not_kept_on_top(page):
    parts = re.findall(r"<section id='(\w+)'", page)
    assert parts == [
        "verdicts", "figures", "route", "supports", "overbridges", "span", "temperature", "wind", "droppers",
    ]  # fmt: skip
    marks = re.findall(r"<span class='(pass|near|fail)'>", page)
    assert marks == sorted(marks, key=("fail", "near", "pass").index)
    assert set(marks) == {"fail", "pass"}
    assert "head of 1600 mm (norms/lateral.toml)" in page


def test_the_dropper_sheet_has_every_dropper_in_millimetres(page, statics_folder):
    with (statics_folder / "droppers.csv").open() as file:
        listed = [[float(value) for value in row] for row in [*csv.reader(file)][1:]]
    sheet = page[page.index("<section id='droppers'") :]
    rows = re.findall(r"<tr[^>]*>(<td.*?)</tr>", sheet)
    assert len(rows) == len(listed) == 20
    cells = re.findall(r">([^<]+)</td>", rows[7])
    x, length, tension, _ = listed[7]
    assert cells == ["2", "3", f"{x:.2f}", f"{x - 50.0:.2f}", f"{1e3 * length:.0f}", f"{tension:.1f}"]
    assert "<thead>" in sheet


def test_every_kind_of_error_of_assembly_is_a_condition(line_maker):
    errors = Irregularity(seed=3, dropper_position_sigma=0.05, stagger_sigma=0.01)
    found = dict(conditions(dataclasses.replace(line_maker(), irregularity=errors), 0))
    assert found["errors of assembly, sigma"] == "dropper places 50 mm, stagger 10 mm; seed 3"
