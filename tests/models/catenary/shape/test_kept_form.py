"""A line whose form was kept is the line whose form was found, to the bit."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
import scipy.sparse as sp

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.line_model import CatenaryModel
from models.catenary.shape import kept_form as module
from models.catenary.shape.form_finding import EquilibriumError, find_form
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.numerics import user_cache
from tests.models.conftest import make_fault


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv(user_cache.SWITCH, raising=False)
    return tmp_path / "openpanto/kept"


@pytest.fixture
def found(monkeypatch):
    """Return the lines whose form was found, not taken from the cache."""
    lines = []
    monkeypatch.setattr(module, "find_form", lambda line, mesh: lines.append(line) or find_form(line, mesh))
    return lines


def same(a, b):
    """Whether two things hold the same numbers, to the bit."""
    if sp.issparse(a):
        return same(a.tocoo().coords, b.tocoo().coords) and same(a.tocoo().data, b.tocoo().data)
    if isinstance(a, np.ndarray):
        return (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same, a, b))
    if hasattr(a, "__dataclass_fields__"):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return type(a) is type(b) and a == b


def test_a_kept_form_is_the_found_one_to_the_bit(folder, found, short_line):
    mesh = build_mesh(short_line)
    first, second = (kept_form(short_line, mesh) for _ in range(2))
    assert found == [short_line]
    assert first is not second
    assert same(first, second)
    assert not same(first, replace(second, arm_force=second.arm_force + 1e-13))  # it would see a difference


def test_samples_of_errors_and_faults_share_a_form(folder, found, short_line):
    samples = [
        short_line.with_values({"irregularity.stagger_sigma": 0.01, "irregularity.seed": seed}) for seed in (1, 2)
    ]
    samples.append(replace(short_line, fault=(make_fault("arm_loose", support=2),)))
    states = [kept_form(line, build_mesh(line)) for line in samples]
    assert len(found) == 1
    assert [state.shape.definition for state in states] == samples
    assert len({state.positions.tobytes() for state in states}) == 1


def test_what_changes_a_form_is_found_anew(folder, found, short_line, monkeypatch):
    wire = replace(short_line.contact_wire, tension=np.nextafter(short_line.contact_wire.tension, 1e9))
    for line in (short_line, replace(short_line, contact_wire=wire)):
        kept_form(line, build_mesh(line))
    mesh = build_mesh(short_line)
    raised = replace(mesh, seat=mesh.seat + 1e-12)
    kept_form(short_line, raised)
    monkeypatch.setattr(module, "_processor", lambda: ("another",))
    kept_form(short_line, mesh)
    assert len(found) == len(list(folder.iterdir())) == 4


def test_the_code_belongs_to_the_key(short_line, monkeypatch, tmp_path):
    mesh = build_mesh(short_line)
    before, code = module._key(short_line, mesh), module._code()
    assert code == module._CODE
    (tmp_path / "form_finding.py").write_text("another")
    monkeypatch.setattr(module, "__file__", str(tmp_path / "kept_form.py"))
    assert module._code() != code
    assert module._key(short_line, mesh) == before  # read once: an FMU's folder may be gone by now
    monkeypatch.setattr(module, "_CODE", module._code())
    assert module._key(short_line, mesh) != before
    monkeypatch.setattr(module, "_source", lambda _: tmp_path / "missing.py")
    monkeypatch.setattr(module, "_CODE", module._code())
    assert module._key(short_line, mesh) == ""


@pytest.mark.parametrize("kept", [{}, {"points": np.zeros((2, 3))}])
def test_numbers_of_another_line_are_not_taken(folder, found, short_line, kept):
    mesh = build_mesh(short_line)
    user_cache.keep_arrays(module._key(short_line, mesh), kept)
    assert same(kept_form(short_line, mesh), find_form(short_line, mesh))
    assert len(found) == 1


def test_without_a_cache_a_line_is_the_same(folder, found, short_line, monkeypatch):
    CatenaryModel(short_line)
    kept = CatenaryModel(short_line)
    monkeypatch.setenv(user_cache.SWITCH, "off")
    without = CatenaryModel(short_line)
    assert len(found) == 2
    assert same(kept.static, without.static)
    assert same(kept.modes, without.modes)


def test_what_has_no_form_is_refused_each_time(folder, short_line):
    heavy: CatenaryDefinition = replace(short_line, profile=replace(short_line.profile, pre_sag=0.5))
    for _ in range(2):
        with pytest.raises(EquilibriumError):
            kept_form(heavy, build_mesh(heavy))
    assert not folder.exists()
