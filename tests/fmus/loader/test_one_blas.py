"""numpy on scipy's OpenBLAS: every function of LAPACK that it calls, in every type, against its own copy."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from fmus.loader.installation import own
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
    found += [np.linalg.solve(many, many + 1), np.linalg.det(many), np.linalg.eigvalsh(many), np.linalg.matrix_rank(tall)]
    # Strides below zero, which numpy tells LAPACK and BLAS in ways of its own.
    found += [np.linalg.solve(a[::-1], b[::-1]), np.linalg.det(a[:, ::-1]), np.linalg.inv(a[::-2, ::-2].T)]
    found += [np.dot(b[::-1, 0], b[:, 1]), a[::-1] @ b[::-1], a.T[::-1] @ b[:, ::-1]]
    results |= {f"{kind}{i}": np.asarray(x) for i, x in enumerate(found)}
    for function in (np.linalg.inv, np.linalg.cholesky):
        try:
            function(np.diag([1.0, 2.0, 0.0, 3.0]).astype(kind) - (function is np.linalg.cholesky) * np.eye(4, dtype=kind))
            raise SystemExit("a singular matrix was taken")
        except np.linalg.LinAlgError:
            pass
np.savez(answer, **results)
"""


def calculate(folder, name, libraries=()):
    answer = folder / f"{name}.npz"
    subprocess.run([sys.executable, "-c", _CALCULATE, str(answer), *map(str, libraries)], check=True)
    return np.load(answer)


def test_numpy_has_the_same_results_on_scipys_copy(tmp_path):
    source = own()
    packages = source.packages["numpy"] / "numpy", source.packages["scipy"] / "scipy"
    modules = {str(path): path for folder in packages for path in folder.glob("linalg/*.so")}
    try:
        libraries = collect_libraries(source, modules, tmp_path)
    except BlasError as error:
        pytest.skip(str(error))
    names = [name for name in libraries.preload if "openblas" in name]
    mine = calculate(tmp_path, "own")
    others = calculate(tmp_path, "other", [libraries.files[name] for name in names])
    for name in mine.files:
        accuracy = 1e-3 if name[0] in "fF" else 1e-10
        np.testing.assert_allclose(others[name], mine[name], rtol=accuracy, atol=accuracy, err_msg=name)
