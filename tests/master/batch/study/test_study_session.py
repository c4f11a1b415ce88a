"""Running a family."""

import json

import pytest

from master.batch.batch_session import Runner
from master.batch.study.family import load_family
from master.batch.study.study_session import study
from master.batch.study.variants import calibrate_variant, opened_variant
from master.commands.main import main
from master.errors import InterruptedRunError, MasterError, RequestError
from master.results.results_folder import is_ours
from master.system.components import without


@pytest.fixture
def family(family_folder):
    return load_family(str(family_folder))


class CountingRunner(Runner):
    """Counts runs, and is interrupted at one of them."""

    runs = 0
    stop_at = 0

    def run(self, system, folder):
        type(self).runs += 1
        if type(self).runs == type(self).stop_at:
            raise InterruptedRunError("interrupted")
        return super().run(system, folder)


@pytest.fixture
def counting():
    CountingRunner.runs, CountingRunner.stop_at = 0, 0
    return CountingRunner(build=False)


def test_a_study_leaves_page_table_and_runs(family, counting, tmp_path):
    out = tmp_path / "out"
    done = study(family, family.variants, out, counting)
    assert [d.name for d in done.done] == ["soft", "hard, heavy"]
    assert not done.failures
    assert {p.name for p in out.iterdir()} == {"study.json", "study.csv", "study.html", "soft", "hard_heavy"}
    assert is_ours(out / "soft")
    data = json.loads((out / "study.json").read_text())
    assert data["status"] == "complete"
    means = {f["variant"]: f["mean [N]"] for f in data["figures"]}
    assert means["hard, heavy"] - means["soft"] > 5.0


def test_what_is_finished_is_not_run_again(family, counting, tmp_path):
    study(family, family.variants, tmp_path / "out", counting)
    again = study(family, family.variants, tmp_path / "out", counting)
    assert CountingRunner.runs == 2
    assert len(again.done) == 2
    study(family, family.chosen(["soft"]), tmp_path / "out", counting, again=True)
    assert CountingRunner.runs == 3


def test_changed_values_are_run_again(family, counting, family_folder, tmp_path):
    study(family, family.variants, tmp_path / "out", counting)
    table = family_folder / "variants.csv"
    table.write_text(table.read_text().replace("4000", "4100"))
    study(load_family(str(family_folder)), family.chosen([]), tmp_path / "out", counting)
    assert CountingRunner.runs == 2  # chosen are those of the old table: nothing is run
    renewed = load_family(str(family_folder))
    study(renewed, renewed.variants, tmp_path / "out", counting)
    assert CountingRunner.runs == 3


def test_an_interrupted_study_keeps_what_is_finished(family, counting, tmp_path):
    CountingRunner.stop_at = 2
    with pytest.raises(InterruptedRunError):
        study(family, family.variants, tmp_path / "out", counting)
    data = json.loads((tmp_path / "out" / "study.json").read_text())
    assert data["status"] == "interrupted"
    assert [v["name"] for v in data["variants"]] == ["soft"]
    done = study(family, family.variants, tmp_path / "out", counting)
    assert len(done.done) == 2
    assert CountingRunner.runs == 3


def test_chosen_variants_are_reported_with_those_that_are_there(family, counting, tmp_path):
    assert len(study(family, family.chosen(["soft"]), tmp_path / "out", counting).done) == 1
    assert len(study(family, family.chosen(["hard, heavy"]), tmp_path / "out", counting).done) == 2
    assert CountingRunner.runs == 2


def test_a_variant_that_fails_does_not_stop_the_others(family_folder, counting, tmp_path):
    table = family_folder / "variants.csv"
    table.write_text(table.read_text().replace("catenary.stiffness", "catenary.fail_at").replace("4000", "0.5"))
    family = load_family(str(family_folder))
    done = study(family, family.variants, tmp_path / "out", counting)
    assert list(done.failures) == ["soft"]
    assert "100 percent load" in done.failures["soft"]
    assert [d.name for d in done.done] == ["hard, heavy"]


def test_a_foreign_folder_is_left_alone(family, counting, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine").touch()
    with pytest.raises(MasterError, match="is no study of this tool"):
        study(family, family.variants, tmp_path / "out", counting)


def test_static_forces_are_found(family, counting):
    found = calibrate_variant(family, family.variants[0], counting)
    assert found["pantograph.static_force"].result == pytest.approx(150.0, abs=0.5)
    assert found["pantograph.static_force"].value == pytest.approx(150.0, abs=10.0)


def test_a_component_is_taken_out_with_its_connections(family, counting):
    with opened_variant(family, family.variants[0], counting) as system:
        alone = without(system, ["pantograph"])
        assert [c.name for c in alone.components] == ["catenary"]
        assert alone.connections == ()
        assert alone.components[0].inputs == alone.components[0].outputs == ()
        with pytest.raises(RequestError, match="no component 'train'"):
            without(system, ["train"])


def test_command_line(family_folder, in_folder, capsys):
    arguments = ["study", str(family_folder), "--no-build", "--out", "out"]
    assert main([*arguments, "--only", "soft"]) == 0
    assert "soft" in capsys.readouterr().out
    assert main([*arguments, "--list"]) == 0
    assert "hard, heavy" in capsys.readouterr().out
    assert main([*arguments, "--json", "--calibrate", "--only", "soft"]) == 0
    assert json.loads(capsys.readouterr().out)["figures"][0]["mean [N]"] == pytest.approx(150.0, abs=0.5)
    assert main(["study", "nothing"]) == 1
    assert main(["study"]) == 2
    assert "140" not in (family_folder / "variants.csv").read_text()
