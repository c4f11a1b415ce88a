"""What ``couple`` refuses in a sentence that says what to do."""

from models.commands.physics_main import main
from models.library.catalogue import pantograph_path

PROFILE = """
[speed_profile]
time = [[0, 5], "s", "choice: test"]
speed = [[250, 200], "km/h", "choice: test"]
"""


def test_a_speed_profile_is_refused_with_what_to_do(tmp_path, capsys):
    """The sentence of the definition, to leave out ``speed``, would not help: the command needs one."""
    path = tmp_path / "CX.toml"
    path.write_text(pantograph_path("CX").read_text(encoding="utf-8") + PROFILE, encoding="utf-8")
    assert main(["couple", "LN2", str(path), "--speed", "250", "--quiet"]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "has a [speed_profile], and couple runs at the one speed of --speed: take it out, or run a scenario" in said
