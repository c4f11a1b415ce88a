"""What messages on a definition file say: known units, near names, and a mistake of a rule once."""

import math

import pytest

from models.definition_files.message_text import hint
from models.definition_files.si_units import to_si
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import line_path, load_line, load_pantograph, pantograph_path


def test_forces_may_be_in_decanewtons():
    assert math.isclose(to_si(2600.0, "daN", "N"), 26000.0)
    assert math.isclose(to_si(20.0, "daN/m", "N/m"), 200.0)


def test_an_unknown_unit_lists_the_known_ones_of_the_quantity():
    with pytest.raises(ValueError, match=r"unknown unit 'kgf' \(known for 'N': N, daN, kN\)"):
        to_si(2000.0, "kgf", "N")
    with pytest.raises(ValueError, match="did you mean 'kN'"):
        to_si(2.0, "kn", "N")


def mistakes(tmp_path, *changes):
    """Return the problems of LN2's file with some of its text replaced."""
    text = line_path("LN2").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    file = tmp_path / "line.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(DefinitionError) as raised:
        load_line(str(file))
    return raised.value.problems


def test_a_mistyped_key_names_the_one_that_may_be_meant(tmp_path):
    (unknown,) = mistakes(tmp_path, ("tension =", "tenson ="))  # not that tension is missing as well
    assert unknown.key == "contact_wire.tenson"
    assert unknown.text.endswith("did you mean 'tension'?")


def test_a_mistyped_parameter_names_those_that_may_be_meant():
    with pytest.raises(ValueError, match=r"did you mean 'contact_wire\.tension' or 'messenger_wire\.tension'"):
        load_line("LN2").with_values({"wire.tension": 1e4})
    with pytest.raises(ValueError, match=r"did you mean 'contact_wire\.tension'\?"):
        load_line("LN2").with_values({"contact_wire.tention": 1e4})


def test_one_very_near_name_is_enough():
    assert hint("static_farce", ["static_force", "static_friction", "statics"]) == "; did you mean 'static_force'?"


def test_a_mistake_of_a_rule_is_reported_once_for_all_spans(tmp_path):
    """The rule is read for spans of seven lengths; all of them are too short for it."""
    (problem,) = mistakes(tmp_path, ("first = [4.5", "first = [60"))
    assert problem.key == "spans.droppers.first"
    assert problem.text.endswith("more like this)")


def test_a_byte_order_mark_is_no_part_of_a_file(tmp_path):
    file = tmp_path / "LN2.toml"
    file.write_text(line_path("LN2").read_text(encoding="utf-8"), encoding="utf-8-sig")
    assert load_line(str(file)) == load_line("LN2")
    (marked,) = mistakes(tmp_path, ("# LN2", "\ufeff# LN2"), ("tension = [20000,", "tension = [20.0,5,,"))
    assert "decimal comma" in marked.text


def test_a_text_among_the_lengths_of_spans_is_named_and_nothing_that_follows_from_it(tmp_path):
    (problem,) = mistakes(tmp_path, ("45.3, 45.5", '45.3, "45,5"'))
    assert (problem.key, problem.text) == (
        "spans.lengths",
        "'45,5' is not a number; write 45.5, without quotation marks",
    )


def test_a_decimal_comma_in_a_list_is_guessed(tmp_path):
    added, order = mistakes(tmp_path, ("45.3, 45.5", "45.3, 45,5"))
    assert added.text.endswith("correct their lengths or this end; has '45,5' a decimal comma? write 45.5")
    assert order.key == "spans.droppers.first"


def test_a_file_in_another_encoding_is_told_by_line(tmp_path):
    file = tmp_path / "line.toml"
    file.write_bytes(b'name = "line"\n# H\xf6he\n')
    with pytest.raises(DefinitionError, match=r"is not UTF-8 text \(line 2\): save it as UTF-8$"):
        load_line(str(file))


def test_a_definition_of_the_other_kind_is_one_sentence():
    with pytest.raises(DefinitionError, match=r"CX\.toml: type: 'lumped' is a pantograph's: name a line here$"):
        load_line(str(pantograph_path("CX")))
    with pytest.raises(DefinitionError, match="'simple' is none of lumped, multibody; it is a line's: name a panto"):
        load_pantograph(str(line_path("LN2")))
