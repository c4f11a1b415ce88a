"""Checkpoints in files: every bit is kept, and what is not a checkpoint is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from master.errors import MasterError
from master.recording import checkpoint
from master.recording.checkpoint import pack, unpack


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda data: data[:-1], "damaged"),
        (lambda data: data[:200] + bytes([data[200] ^ 1]) + data[201:], "damaged"),
        (lambda data: b"x" + data, "not a checkpoint"),
        (lambda data: b"", "not a checkpoint"),
    ],
)
def test_a_spoilt_file_is_refused(saved, tmp_path, spoil, text):
    path = tmp_path / "spoilt"
    path.write_bytes(spoil(saved[1].read_bytes()))
    with pytest.raises(MasterError, match=text):
        checkpoint.read(path)
    with pytest.raises(MasterError, match="cannot be read"):
        checkpoint.read(tmp_path / "none")


def test_packing_keeps_every_bit(saved):
    found = checkpoint.read(saved[1])
    odd = replace(found, memory=np.array([0.1, -0.0, 5e-324]), outputs={**found.outputs, "x.y": float("nan")})
    again = unpack(pack(odd))
    assert again.memory.tobytes() == odd.memory.tobytes()
    assert np.isnan(again.outputs["x.y"])
    assert replace(again, memory=found.memory, outputs=found.outputs) == replace(
        odd, memory=found.memory, outputs=found.outputs
    )


def test_a_checkpoint_of_another_version_is_refused_in_one_sentence(tmp_path):
    path = tmp_path / "checkpoint.state"
    path.write_bytes(b"openpanto checkpoint 0\nwhatever came then")
    with pytest.raises(MasterError, match="is a checkpoint of format 0, this version reads 2: start the run again"):
        checkpoint.read(path)
    path.write_bytes(b"something else")
    with pytest.raises(MasterError, match="is not a checkpoint"):
        checkpoint.read(path)
