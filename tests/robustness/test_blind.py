"""Blindly changed scenarios: refused in words, or read as what now stands there."""

from __future__ import annotations

import contextlib
import zipfile
from xml.etree import ElementTree

from hypothesis import given, settings

from master.commands.main import main
from master.scenario.open_scenario import open_scenario
from tests.effort import count
from tests.master.conftest import SSV, ssd_text
from tests.master.ssp.test_nested import BINDING
from tests.master.ssp.test_nested import MAPPED as MAPPED_BINDING
from tests.master.ssp.test_nested import MAPPING as NESTED_MAPPING
from tests.robustness.mutation import changes
from tests.robustness.support import PROFILE, TRIED, ask, assert_accepted, assert_refused, put_file

SSD = "SystemStructure.ssd"
TEXTS = {SSD: ssd_text(), "parameters.ssv": SSV}
MAPPING = NESTED_MAPPING.format("ripple")
MAPPED = ssd_text().replace(BINDING, MAPPED_BINDING)


def rewrite(scenario, **changed):
    for name, text in TEXTS.items():
        put_file(scenario / name, text)
    for name, data in changed.items():
        put_file(scenario / name.replace("__", "."), data)


def verdict(scenario, *place, warned=lambda: ()):
    """Whether the scenario is accepted, with the warnings that it must have; if not, that it is refused in words."""
    answer = ask(main, "validate", scenario, "--no-build")
    if answer.code:
        assert_refused(answer)
        assert any(name in answer.err for name in place), answer.err
        return False
    assert_accepted(answer, "valid", warned=warned())
    return True


def unread(data):
    """What must be warned of: annotations that are of other tools, as a letter more makes those of ours."""
    types = {n.get("type") for n in ElementTree.fromstring(data).iter() if n.tag.endswith("}Annotation")}
    return ("are not read",) if types - {"com.opensimulationplatform", "urn:openpanto:ssp"} else ()


def reported(data):
    """What a description says, read by another parser and in another way than the master's."""
    root = ElementTree.fromstring(data)
    every = {n.tag.rpartition("}")[2]: [] for n in root.iter()}
    for n in root.iter():
        every[n.tag.rpartition("}")[2]].append(n)
    wires = [tuple(n.get(k) for k in ("startElement", "startConnector", "endElement", "endConnector"))
             for n in every["Connection"]]  # fmt: skip
    steps = [float(n.get("baseStepSize")) for n in every.get("FixedStepAlgorithm", [])]
    experiment = every["DefaultExperiment"][0]
    interval = every.get("Interval", [ElementTree.Element("Interval")])[0]
    return {
        "components": [(n.get("name"), n.get("source")) for n in every["Component"]],
        "wires": {frozenset((w[:2], w[2:])) for w in wires},
        "times": (float(experiment.get("startTime", "0")), float(experiment.get("stopTime")), *(steps or [1e-3])),
        "interval": tuple(None if interval.get(k) is None else float(interval.get(k)) for k in ("start", "end")),
    }


def read(scenario):
    """The same, as the master has read it."""
    with open_scenario(scenario, build=False) as opened:
        s = opened.system
        return {
            "components": [(c.name, f"resources/{c.fmu.path.name}") for c in s.components],
            "wires": {frozenset(((c.source, c.output), (c.target, c.input))) for c in s.connections},
            "times": (s.start, s.stop, s.step),
            "interval": (s.settings.interval.start, s.settings.interval.end),
        }


@settings(PROFILE, max_examples=count(60, 600))
@given(change=changes())
def test_descriptions(scenario, change):
    TRIED["description, blindly"] += 1
    data = change(ssd_text().encode())
    rewrite(scenario, SystemStructure__ssd=data)
    if verdict(scenario, SSD, warned=lambda: unread(data)):
        assert read(scenario) == reported(data)


@settings(PROFILE, max_examples=count(51, 500))
@given(change=changes())
def test_parameter_sets(scenario, change):
    TRIED["parameter set, blindly"] += 1
    data = change(SSV.encode())
    rewrite(scenario, parameters__ssv=data)
    if verdict(scenario, "parameters.ssv"):
        values = {n.get("name"): float(n[0].get("value")) for n in ElementTree.fromstring(data).iter()
                  if n.tag.endswith("}Parameter")}  # fmt: skip
        with open_scenario(scenario, build=False) as opened:
            assert opened.system.component("pantograph").parameters == values


@settings(PROFILE, max_examples=count(42, 400))
@given(change=changes())
def test_mappings(scenario, change):
    TRIED["mapping, blindly"] += 1
    data = change(MAPPING.encode())
    rewrite(scenario, SystemStructure__ssd=MAPPED.encode(), m__ssm=data)
    wanted, values = {}, {"static_force": 140.0, "ripple": 20.0}

    def warned():
        entries = [n for n in ElementTree.fromstring(data).iter() if n.tag.endswith("}MappingEntry")]
        sources = {n.get("source") for n in entries}
        if not sources <= set(values):
            return ["the parameter set holds no"]
        return ["the mapping names no"] if sources and sources != set(values) else []

    if not verdict(scenario, "m.ssm", "parameter 'pantograph.", warned=warned):
        return
    for entry in (n for n in ElementTree.fromstring(data).iter() if n.tag.endswith("}MappingEntry")):
        linear = next((n for n in entry if n.tag.endswith("}LinearTransformation")), ElementTree.Element("x"))
        factor, offset = float(linear.get("factor", "1")), float(linear.get("offset", "0"))
        if entry.get("source") in values:
            wanted[entry.get("target")] = factor * values[entry.get("source")] + offset
    with open_scenario(scenario, build=False) as opened:
        assert opened.system.component("pantograph").parameters == wanted


def packed(scenario, path):
    rewrite(scenario)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for source in sorted(p for p in scenario.rglob("*") if p.is_file()):
            file.write(source, source.relative_to(scenario).as_posix())
    return path.read_bytes()


@settings(PROFILE, max_examples=count(42, 400))
@given(change=changes())
def test_archives(scenario, tmp_path_factory, change):
    TRIED["archive, blindly"] += 1
    folder = tmp_path_factory.getbasetemp()
    whole = packed(scenario, folder / "whole.ssp")
    path = folder / "changed.ssp"
    put_file(path, change(whole))
    if verdict(path, "changed.ssp", SSD, "parameters.ssv"):
        assert read(path) == read(scenario)  # checksums: what is accepted is what was packed


@settings(PROFILE, max_examples=count(42, 400))
@given(change=changes())
def test_fmus(scenario, change):
    TRIED["FMU, blindly"] += 1
    rewrite(scenario)
    path = scenario / "resources" / "ToyPantograph.fmu"
    whole = path.read_bytes()
    with contextlib.ExitStack() as stack:
        stack.callback(put_file, path, whole)
        put_file(path, change(whole))
        verdict(scenario, "ToyPantograph.fmu")


@settings(PROFILE, max_examples=count(42, 400))
@given(change=changes())
def test_descriptions_of_fmus(scenario, change):
    """Inside the archive, where no checksum protects them."""
    TRIED["FMU's description, blindly"] += 1
    rewrite(scenario)
    path = scenario / "resources" / "ToyPantograph.fmu"
    whole = path.read_bytes()
    with zipfile.ZipFile(path) as file:
        data = file.read("modelDescription.xml")
    with contextlib.ExitStack() as stack:
        stack.callback(put_file, path, whole)
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("modelDescription.xml", change(data))
        if verdict(scenario, "ToyPantograph.fmu", "pantograph"):
            root = ElementTree.fromstring(change(data))
            names = [n.get("name") for n in root.iter("ScalarVariable")]
            with open_scenario(scenario, build=False) as opened:
                assert list(opened.system.component("pantograph").fmu.variables) == names
