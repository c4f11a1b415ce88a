"""Damaged results: the JSON files of a run, value by value and blindly."""

from __future__ import annotations

import copy
import json

import pytest
from hypothesis import given, settings

from master.errors import MasterError
from master.summary_schema import read_geometry, read_summary
from tests.robustness.mutation import changes
from tests.robustness.support import PROFILE, TRIED, assert_worded

PREFIX = "catenary.pantograph[1].contact"
CONTACT = {"index": 1, "catenary": "catenary", "pantograph": "pantograph", "prefix": PREFIX, "told": "p", "ends": {}}
SUMMARY = {
    "generator": "openpanto master", "status": "complete", "scenario": "toy", "contacts": [CONTACT],
    "settings": {"start": 0.0, "stop": 2.0, "step": 0.001, "interval": {"start": 1.0, "end": None}},
    "components": [{"name": "catenary", "parameters": {"x": 1.0}}],
}  # fmt: skip
GEOMETRY = {"catenary": {"support[1].x": 0.0, "support[2].x": 50.0}}
#: What every place may hold; everything else is damage.
NOTHING = object()
VALUES = (None, 1, "x", [], {}, [1], True, 1e3, NOTHING)
NUMBERS = (None, 1, 1e3, NOTHING)
SOUND = {
    ("generator",): VALUES, ("status",): ("x", NOTHING), ("scenario",): ("x", NOTHING), ("contacts",): ([], NOTHING),
    ("contacts", 0, "index"): (1,), ("contacts", 0, "ends"): ({}, NOTHING), ("contacts", 0, "told"): ("x", NOTHING),
    ("contacts", 0, "catenary"): ("x",), ("contacts", 0, "pantograph"): ("x",), ("contacts", 0, "prefix"): ("x",),
    ("settings",): ({}, NOTHING), ("settings", "start"): NUMBERS, ("settings", "stop"): NUMBERS,
    ("settings", "step"): NUMBERS, ("settings", "interval"): ({}, NOTHING),
    ("settings", "interval", "start"): (None, 1, 1e3, NOTHING),
    ("settings", "interval", "end"): (None, 1, 1e3, NOTHING),
    ("components",): ([], NOTHING), ("components", 0, "name"): ("x",), ("components", 0, "parameters"): ({}, NOTHING),
    ("components", 0, "parameters", "x"): VALUES,
}  # fmt: skip


def changed(place, value):
    data = copy.deepcopy(SUMMARY)
    node = data
    for key in place[:-1]:
        node = node[key]
    if value is NOTHING:
        del node[place[-1]]
    else:
        node[place[-1]] = value
    return data


@pytest.mark.parametrize("place", SOUND, ids=lambda p: ".".join(map(str, p)))
def test_every_value_of_a_summary(tmp_path, place):
    path = tmp_path / "summary.json"
    for value in VALUES:
        TRIED["results, value by value"] += 1
        path.write_text(json.dumps(changed(place, value)), encoding="utf-8")
        if any(type(value) is type(v) and value == v for v in SOUND[place]):
            assert read_summary(path) == changed(place, value)
            continue
        with pytest.raises(MasterError, match="is damaged") as error:
            read_summary(path)
        assert_worded(error.value, "summary.json")


@pytest.mark.parametrize(("read", "data"), [(read_summary, SUMMARY), (read_geometry, GEOMETRY)])
@settings(PROFILE, max_examples=300)
@given(change=changes())
def test_blindly(tmp_path_factory, read, data, change):
    TRIED["results, blindly"] += 1
    path = tmp_path_factory.getbasetemp() / "some.json"
    path.write_bytes(change(json.dumps(data, indent=1).encode()))
    try:
        found = read(path)
    except MasterError as error:
        assert_worded(error, "some.json")
        return
    assert found == json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("text", ["", "[]", "1", "null", "{", "[" * 100_000, '{"a": NaN}', '{"a": {"b": "c"}}', "\x00"])
def test_geometry_that_is_none(tmp_path, text):
    TRIED["results, by hand"] += 1
    (tmp_path / "geometry.json").write_text(text, encoding="utf-8")
    with pytest.raises(MasterError, match=r"geometry\.json is damaged"):
        read_geometry(tmp_path / "geometry.json")


def test_a_missing_file(tmp_path):
    TRIED["results, by hand"] += 1
    with pytest.raises(MasterError, match="cannot be read"):
        read_summary(tmp_path / "none.json")
