"""Broken mechanisms, taken as far as a pantograph's figures: refused in words, or analysed; never a traceback."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.commands.physics_main import main
from models.library.catalogue import pantograph_path
from tests.effort import count
from tests.robustness.mutation import changes
from tests.robustness.support import PROFILE, TRIED, Answer, ask, assert_lines, put_file

NAMES = ("CX_multibody", "generic_multibody")
TEXTS = {name: pantograph_path(name).read_text(encoding="utf-8") for name in NAMES}
#: Exact places of a definition: a line of its own.
ENTRY = re.compile(r"^\w+ = ")
#: Of what a mechanism could be made of that is sound by itself: values far from any pantograph's, names mixed up.
SCALES = ("0.0", "1e-12", "1e-6", "-1.0", "1e3", "1e6", "1e12")


def analysed(path, text) -> Answer:
    """Ask for a mechanism's figures; whatever the answer, it is in words."""
    put_file(path, text if isinstance(text, bytes) else text.encode())
    answer = ask(main, "pantograph", path)
    assert answer.code in (0, 1, 2), answer
    assert_lines(answer.err.splitlines())
    assert "Traceback" not in answer.err
    if answer.code:
        said = [line for line in answer.err.splitlines() if not line.startswith("warning: ")]
        assert said[0].startswith("error: "), answer
    assert "nan" not in answer.out, answer
    return answer


def part(cases, sample):
    """Return every case in the long checks, some spread over all of them otherwise."""
    return cases[:: count(max(1, len(cases) // sample), 1)]


def without_a_line(name):
    lines = TEXTS[name].splitlines()
    for i, line in enumerate(lines):
        if ENTRY.match(line):
            yield "\n".join([*lines[:i], *lines[i + 1 :]]) + "\n"


def without_a_table(name):
    heads = [m.start() for m in re.finditer(r"(?m)^\[", TEXTS[name])] + [len(TEXTS[name])]
    for begin, end in pairwise(heads):
        yield TEXTS[name][:begin] + TEXTS[name][end:]


def with_another_name(name):
    """Every reference to a body or joint, empty and to each of the others."""
    text = TEXTS[name]
    known = re.findall(r"(?m)^\[body\.(\w+)\]", text)
    for m in re.finditer(r'(?m)^(body_i|body_j|body|joint) = "(\w+)"$', text):
        for other in ("", *known):
            if other != m[2]:
                yield f'{text[: m.start()]}{m[1]} = "{other}"{text[m.end() :]}'


def with_another_kind(name):
    text = TEXTS[name]
    kinds = sorted(set(re.findall(r'(?m)^kind = "(\w+)"', text)) | {"universal", "fixed", "bushing", "bump_stop"})
    for m in re.finditer(r'(?m)^kind = "(\w+)"$', text):
        yield from (f'{text[: m.start()]}kind = "{k}"{text[m.end() :]}' for k in kinds if k != m[1])


def with_another_size(name):
    text = TEXTS[name]
    for m in re.finditer(r"(?m)^(\w+ = \[)(-?[\d.e-]+)(, )", text):
        for scale in SCALES:
            yield f"{text[: m.start()]}{m[1]}{float(m[2]) * float(scale)!r}{m[3]}{text[m.end() :]}"


MAKERS = (without_a_line, without_a_table, with_another_name, with_another_kind, with_another_size)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("maker", MAKERS, ids=lambda m: m.__name__)
def test_one_thing_is_wrong(tmp_path, name, maker):
    cases = list(maker(name))
    assert len(cases) > 10
    for text in part(cases, 2):
        TRIED["mechanism, one thing wrong"] += 1
        analysed(tmp_path / "broken.toml", text)


@settings(PROFILE, max_examples=count(8, 2500))
@given(change=changes())
def test_blindly(tmp_path_factory, change):
    TRIED["mechanism, blindly"] += 1
    analysed(tmp_path_factory.getbasetemp() / "broken.toml", change(TEXTS["CX_multibody"].encode()))


@settings(PROFILE, max_examples=count(1, 800))
@given(factors=st.lists(st.floats(0.5, 2.0), min_size=4, max_size=4), name=st.sampled_from(NAMES))
def test_masses_and_inertias_of_another_machine(tmp_path_factory, factors, name):
    """Sound ones: a pantograph of other masses has figures."""
    TRIED["mechanism, other masses"] += 1
    turn = iter(factors * 100)
    text = re.sub(r"(?m)^mass = \[([\d.]+),", lambda m: f"mass = [{float(m[1]) * next(turn)!r},", TEXTS[name])
    answer = analysed(tmp_path_factory.getbasetemp() / "sound.toml", text)
    assert answer.code == 0, answer
    assert "Modes, strip free" in answer.out
