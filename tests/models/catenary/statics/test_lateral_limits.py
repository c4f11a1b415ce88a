"""Permissible lateral deviations against the published figures."""

import pytest

from models.definition_files.parameter import ParameterError
from models.library.norm_tables import lateral_norm


@pytest.mark.parametrize(
    ("curvature", "cant", "operating", "mechanical"),
    [(0.0, 0.0, 0.4405, 0.5200), (1 / 3000, 0.12, 0.3988, 0.4782), (1 / 500, 0.15, 0.3719, 0.4513)],
)
def test_a_head_of_1600_mm(curvature, cant, operating, mechanical):
    found = lateral_norm().permissible("1600", 5.30, curvature, cant)
    assert (found.operating, found.mechanical) == pytest.approx((operating, mechanical), abs=1e-4)
    assert found.permissible == min(0.40, found.operating)
    mirrored = lateral_norm().permissible("1600", 5.30, -curvature, -cant)
    assert mirrored == found


def test_the_wider_head_reaches_farther():
    found = [lateral_norm().permissible(head, 5.30, 1 / 300, 0.16) for head in ("1600", "1950")]
    assert found[1].operating - found[0].operating == pytest.approx(0.175)
    assert found[1].cap == 0.55


@pytest.mark.parametrize("height", [4.70, 6.30])
def test_other_heights_are_refused(height):
    with pytest.raises(ParameterError, match=r"permissible deviations are known for 5 \.\.\. 6\.5 m; give a --limit"):
        lateral_norm().permissible("1600", height, 0.0, 0.0)
