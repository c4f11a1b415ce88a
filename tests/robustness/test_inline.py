"""Parameter sets inside the description, and units: what is accepted is what an independent reader finds there."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from master.commands.main import main
from master.scenario.open_scenario import open_scenario
from tests.effort import count
from tests.master.conftest import SSV, ssd_text
from tests.robustness.mutation import changes
from tests.robustness.support import PROFILE, TRIED, ask, assert_quick, assert_refused, put_file
from tests.robustness.test_blind import SSD, TEXTS

BINDING = '<ssd:ParameterBinding source="parameters.ssv"/>'
#: The set of the toy scenario, in thousands of newtons, inside the description; the unit is declared beside it.
SET = """<ssd:ParameterBinding><ssd:ParameterValues>
<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="inline">
<ssv:Parameters>
<ssv:Parameter name="static_force"><ssv:Real value="0.14" unit="kip"/></ssv:Parameter>
<ssv:Parameter name="ripple"><ssv:Real value="20" unit="N"/></ssv:Parameter>
</ssv:Parameters>
<ssv:Units>
<ssc:Unit name="kip"><ssc:BaseUnit kg="1" m="1" s="-2" factor="1000"/></ssc:Unit>
<ssc:Unit name="N"><ssc:BaseUnit kg="1" m="1" s="-2"/></ssc:Unit>
</ssv:Units>
</ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>"""
INLINE = ssd_text().replace(BINDING, SET)
NAMES = {"static_force", "ripple", "speed"}


def write(scenario, text):
    put_file(scenario / "parameters.ssv", SSV)
    put_file(scenario / SSD, text)


def parameters(scenario):
    with open_scenario(scenario, build=False) as opened:
        return opened.system.component("pantograph").parameters


def judged(scenario, text):
    """Whether a description is accepted; if it is not, it is refused in words that name it."""
    write(scenario, text)
    answer = ask(main, "validate", scenario, "--no-build")
    if answer.code:
        assert_refused(answer)
        assert SSD in answer.err, answer.err
        return False
    assert_quick(answer)
    return True


@pytest.fixture(autouse=True)
def _as_it_was(scenario):
    yield
    for name, text in TEXTS.items():
        put_file(scenario / name, text)


def test_the_sound_set_is_taken_in_newtons(scenario):
    TRIED["inline set, sound"] += 1
    assert judged(scenario, INLINE.encode())
    assert parameters(scenario) == pytest.approx({"static_force": 140.0, "ripple": 20.0})


def reported(data):
    """The values of an inline set in newtons, by another parser: values, units and their factors."""
    root = ElementTree.fromstring(data)
    factors = {n.get("name"): float(n[0].get("factor", "1")) for n in root.iter() if n.tag.endswith("}Unit") and len(n)}
    found = {}
    for n in (n for n in root.iter() if n.tag.endswith("}Parameter")):
        found[n.get("name")] = float(n[0].get("value")) * factors.get(n[0].get("unit", "N"), 1.0)
    return found


BEGIN, END = INLINE.index("<ssv:ParameterSet"), INLINE.index("</ssd:ParameterValues>")


@settings(PROFILE, max_examples=count(60, 4000))
@given(change=changes())
def test_inline_sets_blindly(scenario, change):
    TRIED["inline set, blindly"] += 1
    data = INLINE[:BEGIN].encode() + change(INLINE[BEGIN:END].encode()) + INLINE[END:].encode()
    if judged(scenario, data):
        found, wanted = parameters(scenario), reported(data)
        assert set(found) <= NAMES
        assert found == pytest.approx(wanted, rel=1e-12)


CELLS = ("", " ", "NaN", "INF", "1e999", "1,5", "0x1", "1_0", "--1", "x", "\u0663", "9" * 5000, "0", "-0.0", "1e-320")


@pytest.mark.parametrize("place", ['value="0.14"', 'factor="1000"', 'm="1"', 's="-2"', 'unit="kip"', 'name="kip"'])
def test_every_number_and_unit_of_an_inline_set(scenario, place):
    """Whatever stands there is taken as it is, or refused; never taken for something else."""
    accepted = 0
    for cell in CELLS:
        TRIED["inline set, value by value"] += 1
        name = place.partition("=")[0]
        data = INLINE.replace(place, f'{name}="{cell}"', 1).encode()
        if judged(scenario, data):
            accepted += 1
            assert parameters(scenario) == pytest.approx(reported(data), rel=1e-12)
    assert accepted < len(CELLS) / 2


POWERS = st.dictionaries(st.sampled_from(["kg", "m", "s", "A", "K", "mol", "cd", "rad"]), st.integers(-3, 3))


@settings(PROFILE, max_examples=count(48, 3000))
@given(powers=POWERS, factor=st.floats(1e-9, 1e9), offset=st.sampled_from([None, 0.0, 273.15]))
def test_a_unit_of_any_dimension(scenario, powers, factor, offset):
    """Accepted just where it measures a force; then the value is factor times value plus offset."""
    TRIED["unit, any"] += 1
    base = " ".join(f'{k}="{v}"' for k, v in powers.items())
    more = "" if offset is None else f' offset="{offset}"'
    unit = f'<ssc:BaseUnit {base} factor="{factor!r}"{more}/>'
    text = INLINE.replace('<ssc:BaseUnit kg="1" m="1" s="-2" factor="1000"/>', unit)
    is_force = {k: v for k, v in powers.items() if v} == {"kg": 1, "m": 1, "s": -2}
    assert judged(scenario, text.encode()) == is_force
    if is_force:
        assert parameters(scenario)["static_force"] == pytest.approx(0.14 * factor + (offset or 0.0))


@settings(PROFILE, max_examples=count(36, 1000))
@given(factor=st.floats(1e-9, 1e9), value=st.floats(-1e6, 1e6))
def test_a_unit_of_force_by_any_factor(scenario, factor, value):
    TRIED["unit, force"] += 1
    text = INLINE.replace('factor="1000"', f'factor="{factor!r}"').replace('value="0.14"', f'value="{value!r}"')
    lifts = value * factor > 0.0  # what does not is refused, whatever its unit
    assert judged(scenario, text.encode()) == lifts
    if lifts:
        assert parameters(scenario)["static_force"] == pytest.approx(value * factor)


UNITS = ssd_text().replace(
    "<ssd:DefaultExperiment",
    '<ssd:Units>\n<ssc:Unit name="kip"><ssc:BaseUnit kg="1" m="1" s="-2" factor="1000"/></ssc:Unit>\n'
    '<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>\n</ssd:Units>\n<ssd:DefaultExperiment',
)
UNITS_FROM, UNITS_TO = UNITS.index("<ssd:Units>"), UNITS.index("<ssd:DefaultExperiment")


@settings(PROFILE, max_examples=count(48, 3000))
@given(change=changes())
def test_units_blindly(scenario, change):
    """Units that nothing refers to change nothing, if they are any."""
    TRIED["units, blindly"] += 1
    data = UNITS[:UNITS_FROM].encode() + change(UNITS[UNITS_FROM:UNITS_TO].encode()) + UNITS[UNITS_TO:].encode()
    if judged(scenario, data):
        assert parameters(scenario) == {"static_force": 140.0, "ripple": 20.0}
