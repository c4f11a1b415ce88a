"""One run of ``statics`` with all that it can be asked for, whose files several tests look at."""

from pathlib import Path

import pytest

from models.commands.physics_main import main

ROUTE = Path(__file__).parents[3] / "docs" / "build_site" / "probes" / "line_route.toml"
#: A name that no page, CSV file or figure may take for anything else.
NASTY = "<b>A-4</b> & 'x' $a_b$"


@pytest.fixture(scope="session")
def statics_folder(tmp_path_factory):
    """The line of the probes, in a curve, its bridge with a nasty name; over temperature and in the wind."""
    folder = tmp_path_factory.mktemp("statics")
    line = folder / "probe.toml"
    line.write_text(ROUTE.read_text(encoding="utf-8").replace('name = "bridge"', f'name = "{NASTY}"'))
    asked = ("--speed", "120", "--temperature", "-20", "15", "--wind", "29", "--head", "1600")
    assert main(["statics", str(line), *asked, "--out", str(folder / "out")]) == 0
    return folder / "out"
