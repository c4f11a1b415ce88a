"""The skeleton of a batch: what is on disk after each task, and after an end before the last one."""

import json
from dataclasses import dataclass, replace

import pytest

from master.batch.batch_session import BatchFiles, BatchState, run_tasks
from master.errors import InterruptedRunError, MasterError


@dataclass(frozen=True)
class Sums(BatchState):
    found: tuple[int, ...] = ()


FILES = BatchFiles("sum", "a test", "sums.json", lambda s: {"found": s.found, "status": s.status}, {"sums.txt": repr})


def on_disk(folder):
    return json.loads((folder / "sums.json").read_text())


def test_state_is_on_disk_after_each_task(tmp_path):
    seen = []

    def finish(state, task):
        seen.append(on_disk(tmp_path / "out")["found"])
        return replace(state, found=(*state.found, task))

    done = run_tasks(Sums(), (1, 2, 3), finish, FILES, tmp_path / "out")
    assert seen == [[], [1], [1, 2]]
    assert (done.found, done.status) == ((1, 2, 3), "complete")
    assert on_disk(tmp_path / "out") == {"generator": "a test", "found": [1, 2, 3], "status": "complete"}
    assert (tmp_path / "out" / "sums.txt").read_text() == repr(done)


@pytest.mark.parametrize("how", [InterruptedRunError("stop"), KeyboardInterrupt()])
def test_an_interruption_leaves_what_was_finished_and_says_so(tmp_path, how):
    def finish(state, task):
        if task == 2:
            raise how
        return replace(state, found=(*state.found, task))

    with pytest.raises(type(how)):
        run_tasks(Sums(), (1, 2, 3), finish, FILES, tmp_path / "out")
    assert on_disk(tmp_path / "out") == {"generator": "a test", "found": [1], "status": "interrupted"}


def test_a_folder_of_another_batch_is_left_alone(tmp_path):
    other = replace(FILES, generator="another test")
    run_tasks(Sums(), (), lambda state, _: state, other, tmp_path / "out")
    with pytest.raises(MasterError, match="left alone"):
        run_tasks(Sums(), (), lambda state, _: state, FILES, tmp_path / "out")
