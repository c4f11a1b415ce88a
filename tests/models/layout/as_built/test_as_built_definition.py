"""The design's file with what was found: read again it is the line as built, whatever the design looks like."""

from types import SimpleNamespace

import numpy as np
import pytest

from models.catenary.condition.fitted_lengths import droppers_along, fitted_errors
from models.catenary.definition.line_reading import load
from models.catenary.shape.line_mesh import build_mesh
from models.layout.as_built.as_built_definition import as_built_text
from models.layout.as_built.measured_run import AsBuiltError
from models.library.catalogue import line_path


def design_of(definition):
    """As much of a static state as the text needs."""
    return SimpleNamespace(shape=SimpleNamespace(definition=definition, mesh=build_mesh(definition)))


@pytest.mark.parametrize("name", ["LN2", "LN2_overlap", "Shinkansen"])
def test_errors_come_back_from_the_file(name, tmp_path):
    definition = load(line_path(name))
    design = design_of(definition)
    mesh = design.shape.mesh
    errors = np.where(mesh.is_hanger, 0.0, 1e-5 * np.random.default_rng(5).integers(-2000, 2000, len(mesh.droppers)))
    text = as_built_text(line_path(name).read_text(), "asbuilt", design, errors, "run.csv", "Line as it hangs.")
    (tmp_path / "asbuilt.toml").write_text(text)
    found = load(tmp_path / "asbuilt.toml")
    assert found.name == "asbuilt"
    assert fitted_errors(found, mesh) == pytest.approx(errors, abs=1e-9)
    assert text.startswith("# Line as it hangs.\n")
    for index in range(len(definition.sections)):
        assert len(found.sections[index].length_errors) == len(droppers_along(mesh, index))


def test_a_running_surface_is_named(tmp_path):
    design = design_of(load(line_path("LN2")))
    errors = np.zeros(len(design.shape.mesh.droppers))
    text = as_built_text(line_path("LN2").read_text(), "asbuilt", design, errors, "x", "y", "running_surface.csv")
    (tmp_path / "asbuilt.toml").write_text(text)
    (tmp_path / "running_surface.csv").write_text("position [m],height [mm]\n0,0\n500,1\n1100,0\n")
    surface = load(tmp_path / "asbuilt.toml").running_surface
    assert surface is not None
    assert surface.points == ((0.0, 0.0), (500.0, 1e-3), (1100.0, 0.0))


def test_a_file_that_cannot_be_added_to_is_refused():
    design = design_of(load(line_path("LN2")))
    errors = np.zeros(len(design.shape.mesh.droppers))
    text = line_path("LN2").read_text().replace("\n[mesh]\n", "\nmesh = {}\n[other]\n")
    with pytest.raises(AsBuiltError, match="is written so that tables cannot be added"):
        as_built_text(text, "asbuilt", design, errors, "x", "y")
    with pytest.raises(AsBuiltError, match="cannot be copied: it has no line name"):
        as_built_text(text.replace("name = ", "'name' = ", 1), "asbuilt", design, errors, "x", "y")
