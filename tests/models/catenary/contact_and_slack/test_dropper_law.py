"""Which law of slack a dropper follows: as the file says, hangers by their own, and what the library's lines have."""

import dataclasses

import numpy as np
import pytest

from models.catenary.shape.dropper_set import dropper_set
from models.catenary.shape.line_mesh import build_mesh
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import line_names, load_line


def test_the_law_is_tension_unless_the_file_says_otherwise(line_maker):
    dropper = {"stiffness": [100.0, "kN/m", "test"], "mass": [0.11, "kg/m", "test"]}
    assert line_maker(dropper=dropper).dropper.slack_law == "tension"
    assert line_maker(dropper=dropper | {"slack_law": "elastic_only"}).dropper.slack_law == "elastic_only"
    with pytest.raises(DefinitionError, match="'elastic' is none of tension, elastic_only"):
        line_maker(dropper=dropper | {"slack_law": "elastic"})


def test_hangers_follow_their_own_law():
    line = load_line("Shinkansen")
    mesh = build_mesh(line)
    for own, other in (("tension", "elastic_only"), ("elastic_only", "tension")):
        mixed = dataclasses.replace(
            line,
            dropper=dataclasses.replace(line.dropper, slack_law=own),
            hanger=dataclasses.replace(line.hanger, slack_law=other),
        )
        delay = dropper_set(mixed, mesh, mesh.points).slack_delay
        assert np.all(delay[mesh.is_hanger] == (0.0272 if other == "tension" else 0.0))
        assert np.all(delay[~mesh.is_hanger] == (0.0272 if own == "tension" else 0.0))


@pytest.mark.parametrize("name", line_names())
def test_lines_of_the_library_do_not_pull_before_they_are_taut(name):
    """Those whose droppers have the source's damping keep the source's form."""
    line = load_line(name)
    for hung in filter(None, (line.dropper, line.hanger)):
        assert hung.slack_law == "elastic_only" or line.damping.of("dropper").alpha <= 1e-3
