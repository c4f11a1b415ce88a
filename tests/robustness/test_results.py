"""Damaged results: the JSON files of a run, value by value and blindly."""

from __future__ import annotations

import copy
import json
import random
import warnings

import pytest
from hypothesis import given, settings

from master.errors import MasterError
from master.report.comparison_page import comparison_page
from master.report.run_page import page
from master.results import run_results
from master.results.summary_schema import read_geometry, read_summary
from tests.effort import count
from tests.robustness.mutation import changes
from tests.robustness.support import PROFILE, TRIED, assert_lines, assert_worded, put_file

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
        put_file(path, json.dumps(changed(place, value)))
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
    put_file(path, change(json.dumps(data, indent=1).encode()))
    try:
        found = read(path)
    except MasterError as error:
        assert_worded(error, "some.json")
        return
    assert found == json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("text", ["", "[]", "1", "null", "{", "[" * 100_000, '{"a": NaN}', '{"a": {"b": "c"}}', "\x00"])
def test_geometry_that_is_none(tmp_path, text):
    TRIED["results, by hand"] += 1
    put_file(tmp_path / "geometry.json", text)
    with pytest.raises(MasterError, match=r"geometry\.json is damaged"):
        read_geometry(tmp_path / "geometry.json")


def test_a_missing_file(tmp_path):
    TRIED["results, by hand"] += 1
    with pytest.raises(MasterError, match="cannot be read"):
        read_summary(tmp_path / "none.json")


WHOLE = {
    **SUMMARY, "run": "1", "date": "2026", "reason": "", "time_reached": 2.0, "versions": {"python": "3.12"},
    "settings": {"start": 0.0, "stop": 2.0, "step": 0.001, "interval": {"start": 10.0, "end": 80.0},
                 "coupling": {"scheme": "iterative", "order": [], "tolerance": 1e-8, "max_iterations": 50,
                              "weight": 1.0}},
    "components": [{"name": "catenary", "fmu": "a.fmu", "sha256": "ab", "guid": "{1}", "tool": "t", "tolerance": None,
                    "parameters": {"x": 1.0},
                    "inputs": [{"name": "x", "value": 1.0, "unit": "m", "description": "d [s]", "changed": True}]}],
    "warnings": [{"component": "catenary", "text": "sags"}], "scenario_warnings": ["one"], "adjustments": ["two"],
    "interface_power": [{"contact": 1, "energy": 1.0, "transferred": 10.0, "rms": 0.1}],
    "energy": [{"what": "catenary", "text": "1e-9"}],
    "performance": {"wall_time": 1.0, "initialisation_time": 0.1, "real_time_factor": 2.0, "peak_memory": 100.0,
                    "component_time": {"catenary": 0.5}, "isolated": False,
                    "real_time": {"factor": 1.0, "steps": 10, "missed": 1, "lateness": {"maximum": 0.01}}},
    "recordings": ["timeseries.csv"],
}  # fmt: skip
LINE = {
    "catenary": {
        **{f"support[{i}].{n}": v + 50.0 * (i - 1) * (n == "x") for i in (1, 2, 3)
           for n, v in (("x", 0.0), ("y", 0.2), ("z", 5.0), ("messenger_wire.z", 6.4))},
        **{f"dropper[{i}].{n}": v + 50.0 * (i - 1) * (n == "x") for i in (1, 2)
           for n, v in (("x", 25.0), ("lower.y", 0.0), ("lower.z", 5.0), ("upper.z", 6.0), ("length", 1.0))},
    }
}  # fmt: skip
ODD = (*VALUES, "", -1, 0, 1e300, -1e300, 1e-300, [[]], [{}], [None], {"a": 1}, {"a": {}}, "x" * 3000)


def everywhere(data, place=()):
    """Yield every place of a JSON file, the whole left out; of lists the first two entries."""
    entries = enumerate(data[:2]) if isinstance(data, list) else data.items() if isinstance(data, dict) else ()
    for key, value in entries:
        yield (*place, key)
        yield from everywhere(value, (*place, key))


def put(data, place, value):
    data = copy.deepcopy(data)
    node = data
    for key in place[:-1]:
        node = node[key]
    if value is NOTHING:
        del node[place[-1]]
    else:
        node[place[-1]] = value
    return data


def reported(folder):
    """Make the pages that `report` and `compare` write; whether the results were accepted."""
    try:
        done = run_results.read(folder)
    except MasterError as error:
        assert_worded(error, str(folder))
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "<html" in page(done)
        try:
            assert "<html" in comparison_page([done, done])
        except MasterError as error:  # without a contact that has figures there is nothing to compare
            assert_lines(str(error).splitlines())
        return True


def fill(folder, summary=WHOLE, geometry=LINE):
    put_file(folder / "summary.json", json.dumps(summary))
    put_file(folder / "geometry.json", json.dumps(geometry))


@pytest.mark.parametrize("name", ["summary", "geometry"])
def test_reports_of_results_of_another_shape(measured_run, name):
    """Refused on reading, or reported: no place of either file breaks a page."""
    data = {"summary": WHOLE, "geometry": LINE}[name]
    cases = [(place, value) for place in everywhere(data) for value in ODD]
    fill(measured_run)
    assert reported(measured_run)
    verdicts = []
    for place, value in random.Random(name).sample(cases, min(len(cases), count(36, 5000))):
        TRIED[f"results, report of a changed {name}"] += 1
        fill(measured_run, **{name: put(data, place, value)})
        verdicts.append(reported(measured_run))
    assert True in verdicts
    assert False in verdicts


@pytest.mark.parametrize("name", ["summary.json", "geometry.json", "timeseries.csv"])
@settings(PROFILE, max_examples=count(18, 1500))
@given(change=changes())
def test_reports_blindly(measured_results, name, change):
    TRIED["results, report of a blindly changed file"] += 1
    whole = (measured_results / name).read_bytes()
    try:
        put_file(measured_results / name, change(whole))
        reported(measured_results)
    finally:
        put_file(measured_results / name, whole)


@pytest.fixture(scope="module")
def measured_results(tmp_path_factory):
    """Results of a run of 0.2 s, with all that a summary and a geometry can hold."""
    folder = tmp_path_factory.mktemp("results") / "run"
    folder.mkdir()
    fill(folder)
    head = f"time [s],{PREFIX}.force [N],{PREFIX}.x [m]"
    rows = [f"{t / 1000},{150 + t % 7},{t * 0.5}" for t in range(201)]
    put_file(folder / "timeseries.csv", "\n".join([head, *rows]) + "\n")
    return folder
