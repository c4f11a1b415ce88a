"""Definition files: what they may say, and that every mistake in them is reported at once."""

import tomllib

import pytest

from models.catenary.definition.line_definition import Rayleigh
from models.catenary.definition.line_reading import load, read
from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import UnknownNameError, line_names, line_path, load_line

SOURCE = "test"


def definition_of(name: str, **changes: object) -> dict:
    data = tomllib.loads(line_path(name).read_text(encoding="utf-8"))
    for dotted, value in changes.items():
        *path, key = dotted.split("__")
        table = data
        for part in path:
            table = table.setdefault(part, {})
        if value is None:
            del table[key]
        else:
            table[key] = value
    return data


def problems(data: dict) -> dict[str, str]:
    with pytest.raises(DefinitionError) as caught:
        read(Table.from_dict(data, "line.toml"))
    assert all(p.file == "line.toml" for p in caught.value.problems)
    texts = [str(p) for p in caught.value.problems]
    assert len(texts) == len(set(texts)), "a mistake is reported once"
    return {p.key: p.text for p in caught.value.problems}


def test_values_come_in_SI_with_their_sources():
    line = load_line("C270")
    assert line.contact_wire.area == pytest.approx(150e-6)
    assert line.steady_arm.angle == pytest.approx(-0.19199, abs=1e-5)
    assert line.provenance["contact_wire.tension"].source == "Table 5.3"
    assert line.provenance["profile.encumbrance"].is_choice
    assert len(line.sections[0].spans) == 25


def test_damping_by_component_type():
    damping = load_line("Re330").damping
    assert damping.of("contact_wire") == Rayleigh(7.5e-7, 0.0)
    assert damping.of("steady_arm") == Rayleigh(1.0, 0.0)
    assert load_line("C270").damping.of("steady_arm") == Rayleigh(0.0272, 0.0)


def test_every_mistake_is_told_at_once_with_key_and_value():
    found = problems(
        definition_of(
            "LN2",
            contact_wire__tension=[-20000, "N", SOURCE],
            messenger_wire__area=[65.5, "kg", SOURCE],
            contact_wire__colour="red",
            spans__end=[1140.0, "m", SOURCE],
            steady_arm__length=None,
            damping=None,
            clamps__steady_arm=[0.2, "kg", " "],
            contact__exponent=["one", "1", SOURCE],
        )
    )
    assert "-20000 N must be greater than 0" in found["contact_wire.tension"]
    assert "'kg'" in found["messenger_wire.area"]
    assert "unknown key" in found["contact_wire.colour"]
    assert "1136.9" in found["spans.end"]
    assert "1140" in found["spans.end"]
    assert "missing" in found["steady_arm.length"]
    assert "missing" in found["damping"]
    assert "source" in found["clamps.steady_arm"]
    assert "'one'" in found["contact.exponent"]
    assert len(found) == 8


def test_dropper_outside_its_span():
    listed = [{"span": 3, "positions": [[4.5, 20.0, 46.0], "m", SOURCE]}]
    found = problems(definition_of("LN2", spans__listed=listed))
    assert found == {"spans.listed[1].positions": "dropper at 46 m lies outside its span, number 3 of 45.3 m"}


def test_a_rule_that_leaves_the_span_is_told_once_for_every_length():
    found = problems(definition_of("C270", spans__droppers__first=[30.0, "m", SOURCE]))
    assert list(found) == ["spans.droppers.first"]
    assert "rising order" in found["spans.droppers.first"]


def test_spacing_that_does_not_fit():
    found = problems(definition_of("EN50318_2018_AC_simple", spans__droppers__spacing=[6.0, "m", SOURCE]))
    assert found == {"spans.droppers.spacing": "droppers from 4.5 m every 6 m do not fit a span of 55 m"}


def test_listed_spans_must_exist_and_only_once():
    positions = [[4.5, 20.0, 40.0], "m", SOURCE]
    listed = [{"span": 30, "positions": positions}, {"span": 2, "positions": positions}]
    listed.append({"span": 2, "positions": positions})
    found = problems(definition_of("LN2", spans__listed=listed))
    assert found["spans.listed[1].span"] == "there is no span 30: the line has 24"
    assert found["spans.listed[3].span"] == "span 2 is listed twice"
    assert len(found) == 2


def test_spans_without_droppers_need_a_rule():
    found = problems(definition_of("LN2", spans__droppers=None))
    assert "spans.droppers" in found


def test_lengths_fit_the_droppers():
    found = problems(definition_of("LN2", spans__droppers__lengths=[[1.2, 1.1], "m", SOURCE]))
    assert "2 lengths for the 7 droppers" in found["spans.droppers.lengths"]


def test_lengths_and_measured_heights_exclude_each_other():
    data = definition_of("LN2", spans__droppers__lengths=[1.2, "m", SOURCE])
    data["measured"] = {"positions": [[-3.1, 1136.9], "m", SOURCE], "heights": [[5.08, 5.08], "m", SOURCE]}
    assert "lengths" in problems(data)["measured"]


def test_listed_droppers_replace_the_rule_and_keep_their_lengths():
    listed = [{"span": 3, "positions": [[5.0, 20.0, 40.0], "m", SOURCE], "lengths": [[1.2, 1.1, 1.2], "m", SOURCE]}]
    line = read(Table.from_dict(definition_of("LN2", spans__listed=listed)))
    span = line.sections[0].spans[2]
    assert span.droppers == pytest.approx([span.start + 5.0, span.start + 20.0, span.start + 40.0])
    assert span.dropper_lengths == (1.2, 1.1, 1.2)
    assert line.sections[0].spans[3].dropper_lengths == ()


def test_one_length_for_all_droppers():
    line = read(Table.from_dict(definition_of("LN2", spans__droppers__lengths=[110, "cm", SOURCE])))
    assert line.sections[0].spans[0].dropper_lengths == pytest.approx((1.1,) * 7)


@pytest.mark.parametrize(
    ("name", "missing", "key"),
    [
        ("Re330", "stitch_wire", "stitch_wire"),
        ("Shinkansen", "auxiliary_wire", "auxiliary_wire"),
        ("Shinkansen", "hanger", "hanger"),
    ],
)
def test_a_type_needs_its_wires(name, missing, key):
    assert key in problems(definition_of(name, **{missing: None}))


def test_wires_of_another_type_are_mistakes():
    stitch = definition_of("Re330")["stitch_wire"]
    assert "stitch_wire" in problems(definition_of("LN2", stitch_wire=stitch))


def test_stitch_wires_fit_between_the_supports():
    found = problems(definition_of("Re330", stitch_wire__length=[60.0, "m", SOURCE]))
    assert "overlap" in found["stitch_wire.length"]
    found = problems(definition_of("Re330", stitch_wire__length=[8.0, "m", SOURCE]))
    assert "no dropper" in found["stitch_wire.length"]
    found = problems(definition_of("Re330", stitch_wire__tension=[21.0, "kN", SOURCE]))
    assert "messenger" in found["stitch_wire.tension"]


def test_auxiliary_wire_lies_below_the_messenger_wire():
    found = problems(definition_of("Shinkansen", profile__auxiliary_height=[1.6, "m", SOURCE]))
    assert "encumbrance" in found["profile.auxiliary_height"]


def test_measured_heights_cover_the_line():
    data = definition_of("LN2")
    data["measured"] = {"positions": [[0.0, 1136.9], "m", SOURCE], "heights": [[5.08, 5.08], "m", SOURCE]}
    assert "must reach from -3.1 m" in problems(data)["measured.positions"]


def test_unreadable_files(tmp_path):
    with pytest.raises(DefinitionError, match="there is no such file"):
        load(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_text("name = \n", encoding="utf-8")
    with pytest.raises(DefinitionError, match="line 1"):
        load(bad)
    bad.write_bytes(b"name = '\xff'")
    with pytest.raises(DefinitionError, match="UTF-8"):
        load(bad)


def test_an_empty_file_names_every_missing_table():
    found = problems({})
    tables = {"profile", "spans", "stagger", "ends", "contact_wire", "messenger_wire", "dropper", "damping"}
    assert tables | {"type", "name"} <= set(found)


def test_parameters_can_be_changed_within_their_range():
    line = load_line("Re330")
    changed = line.with_values({"stitch_wire.tension": 3000.0, "damping.contact_wire.alpha": 1e-6})
    assert changed.stitch_wire.tension == 3000.0
    assert changed.damping.of("contact_wire").alpha == 1e-6
    assert line.stitch_wire.tension == 3500.0
    with pytest.raises(ParameterError, match="must be greater than 0"):
        line.with_values({"contact_wire.tension": -1.0})
    with pytest.raises(ParameterError, match="none of this name"):
        line.with_values({"contact_wire.colour": 1.0})


@pytest.mark.parametrize("name", line_names())
def test_changing_every_parameter_to_its_own_value_changes_nothing(name):
    line = load_line(name)
    assert line.with_values({p.name: p.value for p in line.parameters()}) == line


def test_unknown_lines_are_told_with_the_known_ones():
    with pytest.raises(UnknownNameError, match="Re330"):
        load_line("LN7")


def test_a_file_may_set_what_the_line_declares_at_its_root(line_maker):
    line = line_maker(extrapolation_order=1, monitor_energy=1, time_step=[2.0, "ms", "test"])
    assert (line.extrapolation_order, line.monitor_energy, line.time_step) == (1, 1, 0.002)


def fault(**values):
    return {"kind": "dropper_broken", "span": 12, "dropper": 4} | values


def test_faults_are_read_with_their_parameters():
    slip = fault(kind="dropper_slipped", dropper=5, value=[20, "mm", SOURCE], active=0)
    line = read(Table.from_dict(definition_of("LN2", fault=[fault(), slip])))
    assert [(f.kind, f.section, f.span, f.dropper, f.active, f.value) for f in line.fault] == [
        ("dropper_broken", 1, 12, 4, 1, None),
        ("dropper_slipped", 1, 12, 5, 0, 0.02),
    ]
    names = [p.name for p in line.parameters() if p.name.startswith(("fault", "irregularity"))]
    assert names == [
        "irregularity.seed",
        "irregularity.dropper_length_sigma",
        "irregularity.dropper_position_sigma",
        "irregularity.support_height_sigma",
        "irregularity.stagger_sigma",
        "fault[1].active",
        "fault[2].active",
        "fault[2].value",
    ]
    described = {p.name: p.description for p in line.parameters()}
    for number, f in enumerate(line.fault, 1):
        span = line.sections[0].spans[f.span - 1]
        place = f"at {span.droppers[f.dropper - 1]:.2f} m, supports at {span.start:.2f} and {span.end:.2f} m"
        assert described[f"fault[{number}].active"].endswith(f"; dropper {f.dropper} of span {f.span} {place}")
    (value,) = (p for p in line.parameters() if p.name == "fault[2].value")
    assert (value.value, value.unit, value.source) == (0.02, "m", SOURCE)
    changed = line.with_values({"fault[2].active": 1, "fault[2].value": 0.03, "irregularity.seed": 2**31 - 1})
    assert (changed.fault[1].active, changed.fault[1].value) == (1, 0.03)
    assert changed.fault[0] == line.fault[0]
    assert changed.irregularity.seed == 2**31 - 1


def test_every_mistake_in_a_fault_is_told():
    found = problems(
        definition_of(
            "LN2",
            fault=[
                fault(span=25),
                fault(dropper=8),
                fault(section=2),
                fault(),
                fault(kind="dropper_slipped", value=[10, "mm", SOURCE]),
                fault(span=3, kind="dropper_slipped"),
                fault(span=4, value=[10, "mm", SOURCE]),
                fault(span=5, kind="dropper_slipped", value=[10, "kg", SOURCE]),
                fault(span=6, kind="arm_bent"),
                fault(span=7, active=2),
                fault(span=8, colour="red"),
                fault(span=9, kind="dropper_slipped", value=[6, "m", SOURCE]),
                {"kind": "dropper_broken", "dropper": 1},
            ],
        )
    )
    assert found["fault[1].span"] == "there is no span 25: the section has 24"
    assert found["fault[2].dropper"] == "there is no dropper 8: span 12 has 7"
    assert found["fault[3].section"] == "there is no section 2: the line has 1"
    assert found["fault[5].dropper"] == "dropper 4 of span 12 has a fault already, fault[4]"
    assert found["fault[6].value"] == "is missing: how far has the dropper slipped?"
    assert "remove it" in found["fault[7].value"]
    assert "kg" in found["fault[8].value"]
    assert "dropper_broken, dropper_slipped" in found["fault[9].kind"]
    assert "outside 0 ... 1" in found["fault[10].active"]
    assert "unknown key" in found["fault[11].colour"]
    assert "outside -5 ... 5" in found["fault[12].value"]
    assert found["fault[13].span"] == "is missing"
    assert len(found) == 12


#: Faults of LN2 that say all that is needed, one of each other kind.
WHOLE = {
    "arm_loose": {"support": 3},
    "support_sunk": {"support": 4, "value": [20, "mm", SOURCE]},
    "tension_loss": {"wire": "contact_wire", "value": [0.1, "1", SOURCE]},
    "wear": {"from": [200, "m", SOURCE], "to": [300, "m", SOURCE], "value": [0.2, "1", SOURCE]},
    "hard_point": {"position": [500, "m", SOURCE], "value": [5, "kg", SOURCE]},
}


def other(kind, **values):
    return {"kind": kind} | WHOLE[kind] | values


def test_faults_of_arms_supports_wires_are_read_with_their_parameters():
    line = read(Table.from_dict(definition_of("LN2", fault=[other(kind, active=0) for kind in WHOLE])))
    found = {p.name: p for p in line.parameters() if p.name.startswith("fault")}
    assert [(name, p.unit) for name, p in found.items()] == [
        ("fault[1].active", "1"),
        ("fault[2].active", "1"),
        ("fault[2].value", "m"),
        ("fault[3].active", "1"),
        ("fault[3].value", "1"),
        ("fault[4].active", "1"),
        ("fault[4].value", "1"),
        ("fault[5].active", "1"),
        ("fault[5].value", "kg"),
    ]
    assert [p.description.partition("; ")[2] for name, p in found.items() if "active" in name] == [
        f"steady arm of support 3 at {line.sections[0].supports[3].x:.2f} m",
        f"support 4 at {line.sections[0].supports[4].x:.2f} m",
        "tension of the contact wire",
        "contact wire from 200 m to 300 m",
        "contact wire at 500 m",
    ]
    changed = line.with_values({"fault[2].value": 0.05, "fault[5].active": 1})
    assert (changed.fault[1].amount, changed.fault[4].active) == (0.05, 1)
    with pytest.raises(ParameterError, match=r"fault\[3\]\.value"):
        line.with_values({"fault[3].value": 0.6})


@pytest.mark.parametrize(
    ("fault", "key", "said"),
    [
        (other("arm_loose", support=40), "support", "there is no support 40: between its anchors the section has 23"),
        (other("arm_loose", value=[1, "m", SOURCE]), "value", "means nothing for kind 'arm_loose', of dropper_slipped"),
        (other("arm_loose", dropper=2), "dropper", "of dropper_broken, dropper_slipped: remove it"),
        (other("support_sunk", value=[2, "m", SOURCE]), "value", "outside -1 ... 1 m"),
        ({"kind": "support_sunk", "support": 4}, "value", "is missing: how far has the support sunk?"),
        ({"kind": "support_sunk", "value": [1, "mm", SOURCE]}, "support", "is missing"),
        ({"kind": "arm_loose"}, "support", "is missing"),
        (other("tension_loss", wire="stitch_wire"), "wire", "none of contact_wire, messenger_wire, auxiliary_wire"),
        (other("tension_loss", wire="auxiliary_wire"), "wire", "the line has no auxiliary wire"),
        (other("tension_loss", value=[0.6, "1", SOURCE]), "value", "outside 0 ... 0.5"),
        (other("tension_loss", value=[2, "kN", SOURCE]), "value", "unit"),
        ({"kind": "tension_loss", "wire": "contact_wire"}, "value", "is missing: which share of the tension is lost?"),
        (other("wear", to=[100, "m", SOURCE]), "to", "100 m: must be 0.1 m or more beyond 'from', 200 m"),
        (other("wear", to=[5000, "m", SOURCE]), "to", "5000 m lies outside the section, -3.1 ... 1136.9 m"),
        (other("wear", value=[-0.1, "1", SOURCE]), "value", "outside 0 ... 0.5"),
        ({k: v for k, v in other("wear").items() if k != "from"}, "from", "is missing"),
        (
            other("hard_point", position=[-5, "m", SOURCE]),
            "position",
            "-5 m lies outside the section, -3.1 ... 1136.9 m",
        ),
        (other("hard_point", value=[300, "kg", SOURCE]), "value", "outside 0 ... 200 kg"),
        (other("wear", lost_thickness=[30, "mm", SOURCE]), "lost_thickness", "outside 0 ... 0.02 m"),
        (other("wear", height=[1, "mm", SOURCE]), "height", "means nothing for kind 'wear', of hard_point: remove it"),
        (other("hard_point", height=[-1, "mm", SOURCE]), "length", "is missing: how long is the bump"),
        (other("hard_point", length=[1, "m", SOURCE]), "height", "is missing: how high is the bump"),
        (other("hard_point", section=2), "section", "there is no section 2: the line has 1"),
    ],
)
def test_a_mistake_in_a_fault_of_another_kind_is_told_once(fault, key, said):
    found = problems(definition_of("LN2", fault=[fault]))
    assert set(found) == {f"fault[1].{key}"}
    assert said in found[f"fault[1].{key}"]


def test_an_arm_that_is_not_there_cannot_come_off():
    found = problems(definition_of("LN2", steady_arm=None, fault=[other("arm_loose")]))
    assert found["fault[1].support"] == "support 3 has no steady arm that could come off"


@pytest.mark.parametrize("kind", WHOLE)
def test_two_faults_of_the_same_are_refused(kind):
    found = problems(definition_of("LN2", fault=[other(kind), fault(), other(kind)]))
    (text,) = found.values()
    assert "has a fault already, fault[1]" in text


def test_worn_wire_is_worn_once_and_a_support_sinks_under_a_loose_arm():
    worn = other("wear", **{"from": [250, "m", SOURCE], "to": [320, "m", SOURCE]})
    found = problems(definition_of("LN2", fault=[other("wear"), worn]))
    assert found == {"fault[2].from": "250 m: what is worn there is that of fault[1] already"}
    both = [other("arm_loose", support=4), other("support_sunk")]
    assert len(read(Table.from_dict(definition_of("LN2", fault=both))).fault) == 2


def test_errors_of_assembly_have_ranges():
    found = problems(
        definition_of("LN2", irregularity={"seed": -1, "dropper_length_sigma": [-1, "mm", SOURCE], "sigma": 1})
    )
    assert set(found) == {"irregularity.seed", "irregularity.dropper_length_sigma", "irregularity.sigma"}
    line = load_line("LN2")
    for name, value in {"seed": 2.5, "support_height_sigma": 0.6, "dropper_length_sigma": float("nan")}.items():
        with pytest.raises(ParameterError, match=name):
            line.with_values({f"irregularity.{name}": value})
