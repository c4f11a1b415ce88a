"""A line that is not ours: heights of two strings with one dropper too long, and the error that is found in them."""

import numpy as np
import pytest

from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.statics.wire_course import wire_courses
from models.layout.as_built.as_built_line import find_as_built
from models.layout.as_built.measured_run import MeasuredRun
from tests.models.catenary.condition.test_condition_of_strings import DX, SPAN, Strings
from tests.models.conftest import make_line


def test_an_error_of_strings_is_found_in_their_heights():
    """Of the first dropper of the middle span, whose influence reaches over two spans; strings do not bend."""
    line, strings = make_line(5, length=SPAN), Strings()
    design = kept_form(line, build_mesh(line))
    x = DX * np.arange(strings.n)
    rise = strings.at_rest(longer=0.01, dropper=14)[0] - strings.at_rest()[0]
    nothing = np.full(len(x), np.nan)
    height = wire_courses(design)[0].height(x) + rise
    found = find_as_built(line, MeasuredRun("strings", x, height, nothing, nothing, ("",) * len(x)))
    assert 1e3 * found.error[14] == pytest.approx(10.0, rel=0.02)
    assert 1e3 * np.abs(np.delete(found.error, 14)).max() < 0.1
