"""Copies of definitions under another name."""

import tomllib

import pytest

from models.library.catalogue import (
    line_names,
    line_path,
    load_line,
    load_pantograph,
    pantograph_names,
    pantograph_path,
)
from models.library.definition_copy import CopyError, checked_name, renamed

FILES = [line_path(n, ()) for n in line_names()] + [pantograph_path(n, ()) for n in pantograph_names()]


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_a_copy_differs_from_the_original_in_the_line_of_the_name_alone(path, tmp_path):
    text = path.read_text(encoding="utf-8")
    copy = renamed(text, "my_copy")
    pairs = list(zip(text.split("\n"), copy.split("\n"), strict=True))
    assert [pair for pair in pairs if pair[0] != pair[1]] == [(f'name = "{path.stem}"', 'name = "my_copy"')]
    file = tmp_path / "my_copy.toml"
    file.write_text(copy, encoding="utf-8")
    load = load_line if path.parent.name == "lines" else load_pantograph
    assert load(str(file)).name == "my_copy"


def test_only_the_definitions_own_name_is_changed():
    text = '# name = "no"\ntitle = \'name = "x"\'\nname=\'A\' # why\n[body]\nname = "arm"\n'
    assert tomllib.loads(renamed(text, "B")) == {**tomllib.loads(text), "name": "B"}
    assert "# why" in renamed(text, "B")


@pytest.mark.parametrize("text", ["", "[body]\nname = 'arm'\n", "name = 3\n", 'name = "A\nx'])
def test_a_file_without_a_name_is_not_copied(text):
    with pytest.raises(CopyError):
        renamed(text, "B")


@pytest.mark.parametrize(
    "name", ["", "a/b", "..", "a b", "a.b", "x" * 61, "caf\N{LATIN SMALL LETTER E WITH ACUTE}", "-x"]
)
def test_a_name_that_is_no_file_name_is_refused(name):
    with pytest.raises(CopyError, match="take letters, digits and _"):
        checked_name(name)
    assert checked_name("my_LN2_3") == "my_LN2_3"
