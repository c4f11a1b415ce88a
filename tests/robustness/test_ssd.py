"""Broken scenarios: every element and attribute, removed, doubled, misspelt, of another type or without measure."""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from lxml import etree

from master.commands.main import main
from master.scenario.open_scenario import open_scenario
from tests.effort import IS_LONG
from tests.master.conftest import SSV, ssd_text
from tests.robustness.support import TRIED, ask, assert_accepted, assert_refused, put_file

SSD, SSV_NAME = "SystemStructure.ssd", "parameters.ssv"
RUN = (
    '<panto:Coupling scheme="gauss-seidel" order="pantograph catenary" tolerance="1e-6" maxIterations="7"/>'
    '<panto:Interval start="20" end="45"/>'
    '<panto:Calibration parameter="pantograph.static_force" meanForce="157.5" tolerance="0.1"/>'
    '<panto:Record variables="catenary.dropper[*].force" every="0.01"/>'
)
TEXTS = {SSD: ssd_text(RUN).replace("><", ">\n<"), SSV_NAME: SSV}
#: Attributes that hold a number, and those that may hold any text.
NUMBERS = {
    "startTime", "stopTime", "baseStepSize", "start", "end", "meanForce", "tolerance", "every", "maxIterations",
    "value",
}  # fmt: skip
FREE = {("SystemStructureDescription", "name"), ("System", "name"), ("ParameterSet", "name"), ("Annotation", "type")}
#: Elements that a scenario can do without, with all that is in them.
DISPENSABLE = {
    "ParameterBindings", "ParameterBinding", "Parameter", "Parameters", "Annotations", "Annotation", "Algorithm", "Run",
    "FixedStepAlgorithm", "Coupling", "Interval", "Calibration", "Record", "Real",
}  # fmt: skip
NEEDED = {
    ("Real", "Parameter"), ("Parameters", "ParameterSet"), ("ParameterBinding", "ParameterBindings"),
    ("Annotation", "Annotations"),
}  # fmt: skip
OPTIONAL = {
    "startTime", "scheme", "order", "maxIterations", "start", "end", "every", "tolerance",
}  # fmt: skip
BAD_NUMBERS = ("", " ", "NaN", "INF", "-INF", "1e999", "0x10", "1,5", "1_0", "1 2", "soon", "--1", "9" * 100_000, "٣")
BAD_TEXTS = ("", "nix", " ", "A.x ", "a" * 100_000, "..", "[1]", "None", "Straße", "\u202epantograph")


@dataclass(frozen=True)
class Case:
    """A broken document: which file, its text, what must be said (nothing: it is sound), where."""

    file: str
    text: str
    parts: tuple[str, ...] | None
    about: str


def nodes(file: str) -> Iterator[tuple[Any, Any]]:
    """Yield a copy of the document and one of its elements, for every element."""
    root = etree.fromstring(TEXTS[file].encode())
    for index in range(sum(1 for _ in root.iter(etree.Element))):
        fresh = copy.deepcopy(root)
        yield fresh, list(fresh.iter(etree.Element))[index]


def name_of(node: Any) -> str:
    return str(etree.QName(node).localname)


def is_foreign(node: Any) -> bool:
    """Whether other tools' annotations decide what an element may hold."""
    return any("OSPAnnotations" in str(n.tag) for n in (node, *node.iterancestors()))


def made(file: str, root: Any, parts: tuple[str, ...] | None, about: str) -> Case:
    return Case(file, etree.tostring(root, encoding="unicode"), parts, about)


def unknown_attributes(file: str) -> Iterator[Case]:
    for root, node in nodes(file):
        if not is_foreign(node):
            node.set("zzz", "1")
            yield made(file, root, (f"{file}:", "zzz"), f"attribute zzz of {name_of(node)}")


def unknown_elements(file: str) -> Iterator[Case]:
    for root, node in nodes(file):
        if not is_foreign(node) and name_of(node) != "Annotation":
            node.append(etree.Element("zzz"))
            yield made(file, root, (f"{file}:",), f"element zzz in {name_of(node)}")


def doubled_elements(file: str) -> Iterator[Case]:
    for root, node in nodes(file):
        if node.getparent() is not None and name_of(node) not in ("Record", "Algorithm"):
            node.addnext(copy.deepcopy(node))
            sound = name_of(node) == "ParameterBinding" or node.get("type") == "com.opensimulationplatform"
            yield made(file, root, None if sound else (f"{file}:",), f"{name_of(node)} twice")


def removed_elements(file: str) -> Iterator[Case]:
    for root, node in nodes(file):
        if node.getparent() is None:
            continue
        name, inside = name_of(node), name_of(node.getparent())
        node.getparent().remove(node)
        sound = name in DISPENSABLE and (name, inside) not in NEEDED
        yield made(file, root, None if sound else (f"{file}",), f"without {name} {dict(node.attrib)}")


def removed_attributes(file: str) -> Iterator[Case]:
    for root, node in nodes(file):
        for name in node.attrib:
            fresh = copy.deepcopy(root)
            index = list(root.iter(etree.Element)).index(node)
            del list(fresh.iter(etree.Element))[index].attrib[name]
            sound = name in OPTIONAL or (name_of(node), name) == ("Component", "type")
            yield made(file, fresh, None if sound else (f"{file}",), f"{name_of(node)} without {name}")


def changed_attributes(file: str) -> Iterator[Case]:
    """Every value in every place in `.ci/long`; else a quarter in an attribute's first, an eighth in the others."""
    seen: Counter[tuple[str, str]] = Counter()
    for root, node in nodes(file):
        for name in node.attrib:
            if (name_of(node), name) in FREE:
                continue
            values = BAD_NUMBERS if name in NUMBERS else BAD_TEXTS
            place = seen[name_of(node), name]
            seen[name_of(node), name] += 1
            for value in values if IS_LONG else values[place % 8 :: 8 if place else 4]:
                before = node.get(name)
                node.set(name, value)
                sound = (name, value.strip()) in (("order", ""), ("variables", ""))
                yield made(file, root, None if sound else (file,), f"{name_of(node)} {name}={value[:20]!r}")
                node.set(name, before)


def check(scenario: Path, case: Case) -> None:
    for name, text in TEXTS.items():
        put_file(scenario / name, case.text if name == case.file else text)
    answer = ask(main, "validate", scenario, "--no-build")
    TRIED["scenario, element by element"] += 1
    try:
        if case.parts is None:
            assert_accepted(answer, "toy: valid")
        else:
            assert_refused(answer, *case.parts)
    except AssertionError as error:
        raise AssertionError(f"{case.about}: {error}") from None


MAKERS = (
    unknown_attributes, unknown_elements, doubled_elements, removed_elements, removed_attributes, changed_attributes,
)  # fmt: skip


@pytest.mark.parametrize("file", TEXTS)
@pytest.mark.parametrize("maker", MAKERS, ids=lambda m: m.__name__)
def test_every_element_and_attribute(scenario, maker, file):
    cases = list(maker(file))
    assert len(cases) > 3
    failures = []
    for case in cases:
        try:
            check(scenario, case)
        except AssertionError as error:
            failures.append(str(error)[:500])
    assert not failures, f"{len(failures)} of {len(cases)}:\n" + "\n".join(failures)


def test_line_100_is_no_emoji(scenario):
    put_file(scenario / SSD, "\n" * 99 + "<nothing/>")
    assert "error: SystemStructure.ssd:100: is not" in ask(main, "validate", scenario, "--no-build").err


INPUT = '<ssd:Connector name="{}" kind="input"><ssc:Real/></ssd:Connector>'
OUTPUT = '<ssd:Connector name="{}" kind="output"><ssc:Real/></ssd:Connector>'
WIRE = '<ssd:Connection startElement="{}" startConnector="{}" endElement="{}" endConnector="{}"/>'


def passing(name, length):
    """A system that hands ``u`` on to ``y`` through ``length`` systems inside of it."""
    inner = [
        f'<ssd:System name="p{i}"><ssd:Connectors>{INPUT.format("u")}{OUTPUT.format("y")}</ssd:Connectors>'
        '<ssd:Connections><ssd:Connection startConnector="u" endConnector="y"/></ssd:Connections></ssd:System>'
        for i in range(length)
    ]
    wires = [WIRE.format(f"p{i}", "y", f"p{i + 1}", "u") for i in range(length - 1)]
    wires.append('<ssd:Connection startConnector="u" endElement="p0" endConnector="u"/>')
    wires.append(f'<ssd:Connection startElement="p{length - 1}" startConnector="y" endConnector="y"/>')
    return (
        f'<ssd:System name="{name}"><ssd:Connectors>{INPUT.format("u")}{OUTPUT.format("y")}</ssd:Connectors>'
        f"<ssd:Elements>{''.join(inner)}</ssd:Elements><ssd:Connections>{''.join(wires)}</ssd:Connections></ssd:System>"
    )


FED = WIRE.format("catenary", "pantograph[1].contact.x", "pantograph", "contact.x")


@pytest.mark.parametrize("length", [1, 2, 30])
@pytest.mark.parametrize("is_closed", [False, True])
def test_systems_that_hand_values_on(scenario, length, is_closed):
    """From the catenary through a chain of systems to the pantograph; or round in a circle, which nothing feeds."""
    TRIED["scenario, circles"] += 1
    source = ("chain", "y") if is_closed else ("catenary", "pantograph[1].contact.x")
    wires = WIRE.format(*source, "chain", "u") + WIRE.format("chain", "y", "pantograph", "contact.x")
    text = ssd_text().replace("</ssd:Elements>", passing("chain", length) + "</ssd:Elements>", 1)
    assert FED in text
    put_file(scenario / SSD, text.replace(FED, wires))
    put_file(scenario / SSV_NAME, SSV)
    answer = ask(main, "validate", scenario, "--no-build")
    if is_closed:
        assert_refused(answer, f"{SSD}:", "form a circle")
    else:
        assert_accepted(answer, "toy: valid; 2 components, 16 connections")


def test_a_component_that_feeds_itself(scenario):
    TRIED["scenario, circles"] += 1
    own = WIRE.format("pantograph", "A.x", "pantograph", "contact.x")
    put_file(scenario / SSD, ssd_text().replace(FED, own))
    put_file(scenario / SSV_NAME, SSV)
    assert_accepted(ask(main, "validate", scenario, "--no-build"), "toy: valid")
    with open_scenario(scenario, build=False) as opened:
        assert ("pantograph", "pantograph") in {(c.source, c.target) for c in opened.system.connections}


def test_thousands_of_elements_are_answered_at_once(scenario):
    """Three thousand connectors that no FMU has, and as many connections of them."""
    TRIED["scenario, circles"] += 1
    more = "".join(INPUT.format(f"x{i}") for i in range(3000))
    wires = "".join(WIRE.format("catenary", "pantograph[1].contact.x", "pantograph", f"x{i}") for i in range(3000))
    text = ssd_text().replace(INPUT.format("contact.x"), INPUT.format("contact.x") + more)
    put_file(scenario / SSD, text.replace(FED, FED + wires))
    put_file(scenario / SSV_NAME, SSV)
    assert_refused(ask(main, "validate", scenario, "--no-build"), "has no such variable", "more problems")
