"""FMUs that list a fault for every dropper of a span: their names, their tables, what cannot be."""

import tomllib

import pytest

from fmus.builder.fault_list import split_faults
from fmus.builder.recipe import BuildError, gather, recipe
from models.catenary.definition.line_reading import read
from models.definition_files.toml_reader import Table
from models.library.catalogue import line_path, load_line


def test_names_end_with_the_spans():
    assert split_faults("Catenary_LN2_F3", []) == ("Catenary_LN2", "F3")
    assert split_faults("Catenary_LN2_P2_F3F12", []) == ("Catenary_LN2_P2", "F3F12")
    assert split_faults("Catenary_LN2_A3A4", []) == ("Catenary_LN2", "A3A4")
    assert split_faults("Catenary_LN2_A3F4", []) == ("Catenary_LN2_A3F4", "")
    assert split_faults("Catenary_LN2", []) == ("Catenary_LN2", "")
    assert split_faults("Pantograph_CX_F3", []) == ("Pantograph_CX_F3", "")


def test_a_definition_of_the_whole_name_wins(tmp_path):
    (tmp_path / "lines").mkdir()
    (tmp_path / "lines" / "own_F3.toml").write_text("")
    assert split_faults("Catenary_own_F3", [tmp_path]) == ("Catenary_own_F3", "")


def test_the_definition_lists_every_dropper_of_the_spans_once_and_none_is_broken():
    wanted = recipe("Catenary_LN2_P2_F3F4")
    assert (wanted.name, wanted.settings["pantographs"]) == ("Catenary_LN2_P2_F3F4", 2)
    text = gather(wanted).definition.decode()
    line = read(Table.from_dict(tomllib.loads(text)))
    droppers = [len(span.droppers) for span in line.sections[0].spans[2:4]]
    assert [(f.span, f.dropper, f.active) for f in line.fault] == [
        (span, k, 0) for span, count in zip((3, 4), droppers, strict=True) for k in range(1, count + 1)
    ]
    assert gather(wanted).fingerprint != gather(recipe("Catenary_LN2_P2")).fingerprint


@pytest.mark.parametrize(("line", "mark", "supports"), [("LN2", "A3A4", [2, 3, 4]), ("LN2_ring", "A1", [1, 2])])
def test_the_definition_lists_the_arms_at_the_ends_of_spans(line, mark, supports):
    found = read(Table.from_dict(tomllib.loads(gather(recipe(f"Catenary_{line}_{mark}")).definition.decode())))
    assert [(f.kind, f.support, f.active) for f in found.fault] == [("arm_loose", k, 0) for k in supports]


def test_the_last_span_of_a_ring_ends_where_the_first_begins():
    count = len(load_line("LN2_ring").sections[0].spans)
    found = tomllib.loads(gather(recipe(f"Catenary_LN2_ring_A{count}")).definition.decode())["fault"]
    assert [f["support"] for f in found] == [1, count]


def test_an_own_definition_with_faults_is_built_again_from_where_it_lay(tmp_path):
    (tmp_path / "own.toml").write_bytes(line_path("LN2").read_bytes().replace(b'name = "LN2"', b'name = "own"'))
    again = recipe("Catenary_own_F3", built_from=tmp_path / "own.toml")
    assert again.name == "Catenary_own_F3"
    assert again.added.count("[[fault]]") == 7


def test_spans_that_are_not_there():
    with pytest.raises(BuildError, match=r"LN2\.toml has no span 99: its first section has 1 to 24"):
        recipe("Catenary_LN2_F99")
