"""SciPy starts without parts of NumPy that nobody asked for, and NumPy has them all the same."""

import subprocess
import sys

CODE = """
import sys
import numpy
before = numpy.__all__, sorted(dir(numpy))
import fmus.slave.catenary_slave
assert "scipy.sparse.linalg" in sys.modules
print(*[name for name in ("ctypeslib", "f2py", "ma", "polynomial", "testing") if f"numpy.{name}" in sys.modules])
assert (numpy.__all__, sorted(dir(numpy))) == before
print(numpy.polynomial.Polynomial([1.0, 2.0])(3.0))
"""


def test_a_line_loads_no_more_of_numpy_than_it_needs():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("\n7.0\n", "")
