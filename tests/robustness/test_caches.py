"""Changed files of the cache of compiled kernels: found out before they are read, for they are pickles."""

from __future__ import annotations

import pickle

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.numerics.kernel_cache import _checked, _kept_source, _with_checksum
from tests.effort import count
from tests.robustness.mutation import changes
from tests.robustness.support import PROFILE, TRIED, put_file

#: What a file of the cache holds, about: an index, and machine code.
INDEX = _with_checksum(pickle.dumps({"stamp": (1, 2), "overloads": {("f8",): "k.1.nbc"}}))
CODE = _with_checksum(pickle.dumps(("f8", bytes(range(256)) * 8)))


@pytest.mark.parametrize("whole", [INDEX, CODE], ids=["index", "code"])
@settings(PROFILE, max_examples=count(60, 5000))
@given(change=changes())
def test_what_is_changed_is_not_read(tmp_path_factory, whole, change):
    TRIED["cache file, blindly"] += 1
    path = tmp_path_factory.getbasetemp() / "k.nbc.sum"
    put_file(path, data := change(whole))
    if data == whole:
        assert _checked(path) == whole[32:]
        return
    with pytest.raises(ValueError, match="does not match its checksum"):
        _checked(path)


@settings(PROFILE, max_examples=count(36, 1500))
@given(change=changes(), source=st.sampled_from([b"VALUE = 1\n", b"def f(x):\n    return 2 * x\n" * 40]))
def test_a_changed_copy_of_the_source_is_replaced(tmp_path_factory, change, source):
    """The copy is run: it is always the source itself."""
    TRIED["cache file, source"] += 1
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp()))
        copy = _kept_source(source, "key")
        put_file(copy, change(source))
        assert _kept_source(source, "key").read_bytes() == source
