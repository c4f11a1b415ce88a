"""numpy on scipy's OpenBLAS: every function of LAPACK that it calls, in every type, against its own copy."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from fmus.loader.python_installation import own
from fmus.loader.shared_libraries import BlasError, collect_libraries

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux") or shutil.which(os.environ.get("CC", "cc")) is None,
    reason="needs Linux and a C compiler (set CC, or install gcc)",
)
_CALCULATE = """
import ctypes, sys
import pathlib
answer, *libraries = sys.argv[1:]
for library in libraries:
    ctypes.CDLL(library)
import numpy as np
maps = pathlib.Path("/proc/self/maps").read_text()
assert bool(libraries) != ("numpy.libs/libscipy_openblas64_" in maps)
random, results = np.random.default_rng(7), {}
for kind in "fdFD":
    a, b, tall = (random.normal(size=s) + 1j * random.normal(size=s) for s in ((40, 40), (40, 3), (50, 9)))
    a, b, tall = ((x if kind in "FD" else x.real).astype(kind) for x in (a, b, tall))
    positive = a @ a.conj().T + 40 * np.eye(40, dtype=kind)
    many = positive[:6, :6].reshape(1, 6, 6) + np.eye(6, dtype=kind) * np.arange(1, 6).reshape(5, 1, 1)
    q, r = np.linalg.qr(tall)
    found = [a @ b, a @ b[:, 0], np.vdot(b[:, 0], b[:, 1]), a.T @ a, np.dot(b[:, 0], b[:, 1]), np.linalg.solve(a, b)]
    found += [np.linalg.inv(a), np.linalg.det(a), np.linalg.det(a[::-1]), np.linalg.cholesky(positive), q @ r]
    found += [np.sort_complex(np.linalg.eigvals(a)), np.linalg.eigvalsh(positive), np.linalg.svd(tall)[1]]
    found += [np.linalg.lstsq(tall, tall[:, :2] * 2, rcond=None)[0], np.linalg.lstsq(tall, tall, rcond=None)[2]]
    found += [np.linalg.solve(many, many + 1), np.linalg.det(many), np.linalg.eigvalsh(many)]
    # Strides below zero, which numpy passes to LAPACK and BLAS in its own ways.
    found += [np.linalg.solve(a[::-1], b[::-1]), np.linalg.det(a[:, ::-1]), np.linalg.inv(a[::-2, ::-2].T)]
    found += [np.dot(b[::-1, 0], b[:, 1]), a[::-1] @ b[::-1], a.T[::-1] @ b[:, ::-1]]
    results |= {f"{kind}{i}": np.asarray(x) for i, x in enumerate(found)}
    for function in (np.linalg.inv, np.linalg.cholesky):
        try:
            function(np.diag([1.0, -2.0, 0.0, 3.0]).astype(kind))
            raise SystemExit("a singular matrix was taken")
        except np.linalg.LinAlgError:
            pass
np.savez(answer, **results)
"""


def calculate(folder, name, libraries=()):
    answer = folder / f"{name}.npz"
    subprocess.run([sys.executable, "-c", _CALCULATE, str(answer), *map(str, libraries)], check=True)
    return np.load(answer)


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """scipy's OpenBLAS and what hands numpy's calls to it, in the order of opening."""
    source = own()
    packages = source.packages["numpy"] / "numpy", source.packages["scipy"] / "scipy"
    modules = {str(path): path for folder in packages for path in folder.glob("linalg/*.so")}
    try:
        found = collect_libraries(source, modules, tmp_path_factory.mktemp("one_blas"))
    except BlasError as error:
        pytest.skip(str(error))
    return [found.files[name] for name in found.preload if "openblas" in name]


def test_numpy_has_the_same_results_on_scipys_copy(tmp_path, libraries):
    mine = calculate(tmp_path, "own")
    others = calculate(tmp_path, "other", libraries)
    for name in mine.files:
        accuracy = 1e-3 if name[0] in "fF" else 1e-10
        np.testing.assert_allclose(others[name], mine[name], rtol=accuracy, atol=accuracy, err_msg=name)


_CALL = """
import ctypes, sys
import numpy as np
library = [ctypes.CDLL(path) for path in sys.argv[1:]][-1]
def whole(value):
    return ctypes.byref(ctypes.c_int64(value))
def at(array):
    return array.ctypes.data_as(ctypes.c_void_p)
x, y = np.arange(1.0, 9.0), np.zeros(4)
library.scipy_dcopy_64_(whole(4), at(x), whole(-2), at(y), whole(1))
assert y.tolist() == [7.0, 5.0, 3.0, 1.0], y
library.scipy_dcopy_64_(whole(4), at(x), whole(1), at(y), whole(-1))
assert y.tolist() == [4.0, 3.0, 2.0, 1.0], y
# Memory for whole numbers is not clean before a call.
dirt = 0x7EADBEEF7EADBEEF
a, b, pivots, info = np.diag([1.0, 2.0, 4.0]), np.ones((3, 3)), np.full(3, dirt), np.full(1, dirt)
library.scipy_dgesv_64_(whole(3), whole(3), at(a), whole(3), at(pivots), at(b), whole(3), at(info))
assert (pivots.tolist(), info[0]) == ([1, 2, 3], 0), (pivots, info)
s, rank, work, iwork = np.zeros(3), np.full(1, dirt), np.zeros(1), np.full(1, dirt)
condition = ctypes.byref(ctypes.c_double(-1.0))
library.scipy_dgelsd_64_(whole(3), whole(3), whole(3), at(a), whole(3), at(b), whole(3), at(s), condition, at(rank),
                         at(work), whole(-1), at(iwork), at(info))
space, places = int(work[0]), int(iwork[0])
assert 0 < places < 1000, iwork
library.scipy_dgelsd_64_(whole(3), whole(3), whole(3), at(a), whole(3), at(b), whole(3), at(s), condition, at(rank),
                         at(np.zeros(space)), whole(space), at(np.zeros(places, np.int64)), at(info))
assert (rank[0], info[0]) == (3, 0), (rank, info)
"""


def test_whole_numbers_come_back_in_64_bits(libraries):
    subprocess.run([sys.executable, "-c", _CALL, *map(str, libraries)], check=True)
