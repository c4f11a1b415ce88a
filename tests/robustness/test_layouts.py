"""Layouts changed blindly: imported, or refused in sentences that name sheet, row and column."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from models.definition_files.toml_reader import DefinitionError, Problem
from models.layout.layout_import import import_layout
from tests.effort import count
from tests.robustness.mutation import changes
from tests.robustness.support import UNWORDED, put_file

SHEETS = {
    "supports": """\
section;structure;kind;position [m];span_length;height;encumbrance;stagger [mm];arm_length;arm_angle [deg];radius
1;A;anchor;0;50;5.28;1.4;0;;;0
1;M1;unregistered;50;50;5.13;1.4;100;;;0
1;M2;support;100;50;5.08;1.4;200;1.2;-10;0
1;M3;support;150;50;5.08;1.4;-200;1.2;-10;800
1;M4;support;200;50;5.08;1.4;200;1.2;-10;800
1;B;anchor;250;;5.28;1.4;0;;;800
2;B;anchor;200;50;5.28;1.4;0;;;800
2;C;;250;50;5.08;1.4;200;1.2;-10;800
2;D;;300;50;5.08;1.4;-200;1.2;-10;0
2;E;;350;;5.08;1.4;0;;;0
""",
    "droppers": "section;span;dropper;kind;position;length [mm]\n"
    + "".join(f"1;{s};{k};dropper;{9 * k};1300\n" for s in range(1, 6) for k in range(1, 6))
    + "".join(f"2;{s};{k};;{9 * k};\n" for s in range(1, 4) for k in range(1, 6)),
    "wires": """\
component;area [mm2];mass;youngs_modulus [GPa];tension [kN];stiffness;source
contact_wire;150;1.334;120;20;;a book
messenger_wire;65.5;0.605;84.7;14;;
dropper;;0.11;;;1e5;choice: as usual
steady_arm;120;1.07;84.7;;;
""",
    "line": """\
key;value;unit;source
damping.alpha;1e-4;s;a norm
damping.beta;0,0125;1/s;a norm
damping.dropper.alpha;0;s;a norm
damping.dropper.beta;0;1/s;a norm
profile.pre_sag_between;droppers;;
fault[1].kind;dropper_slipped;;
fault[1].span;2;;
fault[1].dropper;3;;
fault[1].value;0;mm;test
""",
}


def written(folder: Path, **changed: bytes) -> Path:
    for name, text in SHEETS.items():
        put_file(folder / f"{name}.csv", changed.get(name, text.encode()))
    return folder


def test_the_layout_as_it_is(tmp_path):
    assert len(import_layout(written(tmp_path), "line").definition.sections) == 2


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("layout")


@given(name=st.sampled_from(sorted(SHEETS)), change=changes())
@settings(max_examples=count(36, 3000), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_changed_layout_is_imported_or_refused_in_words(folder, name, change):
    path = written(folder, **{name: change(SHEETS[name].encode())})
    for problem in problems(path):
        assert problem.key.partition(",")[0] in (*SHEETS, "track"), str(problem)
        assert problem.text
        assert not any(text in str(problem) for text in UNWORDED), str(problem)


def problems(path: Path) -> tuple[Problem, ...]:
    """Return what is wrong with a layout; nothing if it is imported."""
    try:
        import_layout(path, "line")
    except DefinitionError as error:
        return error.problems
    return ()
