"""Reading families and writing values back."""

import pytest

from master.batch.study.family import family_names, load_family, store_values
from master.errors import MasterError, RequestError, ScenarioError


def load(folder):
    return load_family(str(folder))


def test_files_may_begin_with_a_byte_order_mark(family_folder):
    plain = load_family(str(family_folder))
    for name in ("study.toml", "variants.csv"):
        path = family_folder / name
        path.write_text(path.read_text(), encoding="utf-8-sig")
    assert load_family(str(family_folder)) == plain


def test_the_table_says_values_and_run(family_folder):
    family = load(family_folder)
    assert family.name == "toy"
    assert [v.name for v in family.variants] == ["soft", "hard, heavy"]
    assert family.variants[1].values == {"catenary.stiffness": "8000", "pantograph.static_force": "160"}
    assert family.variants[0].stop == 1.0
    assert family.variants[0].absent == ()


def test_a_component_without_values_takes_no_part(family_folder):
    (family_folder / "variants.csv").write_text("variant,a.x,b.x,b.y\none,1,,\nboth,1,2,\n")
    (family_folder / "study.toml").write_text("title='t'\n[[interval]]\nname='i'\nstart=0\nend=1\n")
    assert [v.absent for v in load(family_folder).variants] == [("b",), ()]


def test_families_are_found_by_name(family_folder):
    root = family_folder.parent
    assert family_names(root) == ("toy",)
    assert load_family("toy", root).folder == root / "toy.ssp"
    with pytest.raises(RequestError, match="no study 'boy'; known: toy"):
        load_family("boy", root)


def test_variants_are_chosen_by_name(family_folder):
    family = load(family_folder)
    assert [v.name for v in family.chosen(["hard, heavy"])] == ["hard, heavy"]
    assert family.chosen([]) == family.variants
    with pytest.raises(RequestError, match="no variant 'firm'; known: soft; hard, heavy"):
        family.chosen(["firm"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,a.b\nx,1\n", "first column must be 'variant'"),
        ("variant,a\nx,1\n", "column 'a' is neither"),
        ("variant,a.b\nx,1,2\n", "variants.csv:2: has 3 cells, the head has 2"),
        ("variant,a.b\nx,1\nx,2\n", "'x' appears more than once"),
        ("variant,stop\nx,-1\n", "stop: Input should be greater than 0"),
        ("variant,a.b\n", "has no variant"),
    ],
)
def test_mistakes_in_the_table_are_told(family_folder, text, message):
    (family_folder / "variants.csv").write_text(text)
    with pytest.raises(ScenarioError, match=message):
        load(family_folder)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('title = "Toys"', "", "title: Field required"),
        ("end = 45.0", "end = 5.0", "must lie before end"),
        ('interval = "whole"', 'interval = "half"', "there is no interval 'half'"),
        ('variants = ["soft"]', 'variants = ["loud"]', "there is no variant 'loud'"),
        ("[[interval]]", "[[interval", "cannot be read"),
    ],
)
def test_mistakes_in_the_settings_are_told(family_folder, old, new, message):
    path = family_folder / "study.toml"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ScenarioError, match=message):
        load(family_folder)


def test_only_the_values_change_in_the_table(family_folder):
    before = (family_folder / "variants.csv").read_text()
    store_values(load(family_folder), "hard, heavy", {"pantograph.static_force": 151.23456789})
    assert (family_folder / "variants.csv").read_text() == before.replace("160", "151.235")
    with pytest.raises(MasterError, match="row 'firm'"):
        store_values(load(family_folder), "firm", {"pantograph.static_force": 1.0})


def test_the_families_of_the_repository_can_be_read():
    for name in family_names():
        assert load_family(name).variants
