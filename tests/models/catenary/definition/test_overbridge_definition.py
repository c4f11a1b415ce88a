"""What stands over a line, as read: mistakes told by key and value, and nothing of it a parameter of an FMU."""

import pytest

from models.definition_files.toml_reader import DefinitionError


def bridge(**changes):
    source = "test"
    made = {
        "name": "A-4",
        "start": [110.0, "m", source],
        "end": [120.0, "m", source],
        "underside": [7.0, "m", source],
    }
    return made | changes


def test_bridges_are_read_and_no_parameter_comes_of_them(line_maker, short_line):
    line = line_maker(overbridge=[bridge(), bridge(name="footbridge", lift=[80, "mm", "test"])])
    assert [(over.name, over.end, over.lift) for over in line.overbridge] == [
        ("A-4", 120.0, None),
        ("footbridge", 120.0, 0.08),
    ]
    assert [p.name for p in line.parameters()] == [p.name for p in short_line.parameters()]


@pytest.mark.parametrize(
    ("listed", "answer"),
    [
        ([bridge(end=[110.0, "m", "t"])], "overbridge[1].end: 110 m must be greater than start, 110 m"),
        ([bridge(start=[-1.0, "m", "t"])], "overbridge[1].start: -1 m lies outside the line, 0 ... 300 m"),
        ([bridge(), bridge()], "overbridge[2].name: 'A-4' is that of overbridge[1] already"),
        ([bridge(name="")], "overbridge[1].name: is empty"),
        (
            [bridge(clearance=[0.2, "m", "t"], clearance_lifted=[0.3, "m", "t"])],
            "overbridge[1].clearance_lifted: 0.3 m must not be greater than clearance, 0.2 m",
        ),
    ],
)
def test_mistakes(line_maker, listed, answer):
    with pytest.raises(DefinitionError) as caught:
        line_maker(overbridge=listed)
    assert answer in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
