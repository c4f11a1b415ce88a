"""A state is what it was, bit for bit, or is refused in words."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from fmus.slave.saved_state import SavedState, StateError, pack, unpack
from master.safety import array_container

ARRAYS = st.dictionaries(
    st.text(min_size=1, max_size=8),
    st.sampled_from(["f8", "i8", "?", "f4", "U3"]).flatmap(
        lambda d: npst.arrays(d, npst.array_shapes(min_dims=0, min_side=0, max_side=4))
    ),
    max_size=4,
)


@given(ARRAYS)
def test_arrays_come_back_bit_for_bit(arrays):
    about, back = unpack(pack({"model": "toy ü"}, arrays))
    assert about == {"model": "toy ü"}
    assert back.keys() == arrays.keys()
    for name, array in arrays.items():
        assert back[name].dtype == array.dtype
        assert back[name].shape == array.shape
        assert back[name].tobytes() == np.asarray(array).tobytes()


def test_not_a_number_keeps_its_payload():
    odd = np.array([0x7FF8_0000_0000_00AB, 0x8000_0000_0000_0000], dtype=np.uint64).view(np.float64)
    assert unpack(pack({}, {"a": odd}))[1]["a"].tobytes() == odd.tobytes()


@pytest.mark.parametrize("position", [0, 20, 40, -40, -1])
def test_a_changed_byte_is_noticed(position):
    data = bytearray(pack({"model": "toy"}, {"x": np.arange(9.0)}))
    data[position] ^= 1
    with pytest.raises(StateError, match=r"checksum|not a saved state"):
        unpack(bytes(data))


@pytest.mark.parametrize("data", [b"", b"{}", b"\x80\x04.", pack({}, {"x": np.zeros(3)})[:-5]])
def test_foreign_or_cut_bytes_are_refused(data):
    with pytest.raises(StateError):
        unpack(data)


def test_python_objects_are_refused():
    with pytest.raises(StateError, match="'bad'"):
        pack({}, {"bad": np.array([object()])})


def test_the_master_reads_the_state_of_an_fmu(instantiate):
    instance = instantiate()
    instance.initialise(force=2.0)
    instance.run(3)
    header, arrays = array_container.unpack(instance.slave.serializeFMUstate(instance.slave.getFMUstate()))
    assert (header["model"], header["phase"]) == ("Toy", "stepping")
    assert arrays["time"] == 3e-3
    assert arrays["values"][instance.references["force"]] == instance["force"]
    assert arrays["part.x"].tolist() == instance.get(["mass[1].z", "mass[2].z"])


@given(ARRAYS)
def test_both_packages_write_one_layout(arrays):
    data = array_container.pack({"model": "toy ü"}, {name: np.asarray(array) for name, array in arrays.items()})
    header, back = unpack(data)
    assert header == {"model": "toy ü"}
    assert {name: (a.dtype, a.shape, a.tobytes()) for name, a in back.items()} == {
        name: (a.dtype, a.shape, a.tobytes()) for name, a in arrays.items()
    }
    with pytest.raises(StateError, match="not a saved state"):
        SavedState.from_bytes(data)
