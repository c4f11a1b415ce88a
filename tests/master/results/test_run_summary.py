"""The memory that a run tells is its own."""

import subprocess
import sys

import numpy as np


def test_memory_of_the_program_that_starts_a_run_is_not_counted():
    """A program with 300 MB starts one that needs a tenth of it."""
    ballast = np.ones(300 * 2**17)
    code = "from master.results.run_summary import peak_memory; print(peak_memory())"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ballast.sum() == ballast.size
    assert 5.0 < float(answer.stdout) < 250.0
