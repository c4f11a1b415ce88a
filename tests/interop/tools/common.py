"""What the tools' runners share: their command line and the file they leave.

A runner is started as ``python RUNNER ARCHIVE STOP STEP OUT``, in a separate process: a crash of the tool, or of the
FMUs in it, then ends that process only. It writes a row per step, the time at the step's end and the contact force,
and prints the wall time of initialization and of stepping as JSON.
"""

import json
import sys
import time
from pathlib import Path

COMPONENT = "catenary"
VARIABLE = "pantograph[1].contact.force"


class Watch:
    """Wall time of initialization and of stepping."""

    def __init__(self):
        self._marks = [time.perf_counter()]

    def mark(self):
        self._marks.append(time.perf_counter())

    def report(self):
        initialisation, stepping = (b - a for a, b in zip(self._marks, self._marks[1:], strict=False))
        print(json.dumps({"initialisation": initialisation, "stepping": stepping}), flush=True)


def arguments():
    archive, stop, step, out = sys.argv[1:]
    step = float(step)
    return archive, step, round(float(stop) / step), Path(out)


def write(out, step, forces):
    rows = (f"{(n + 1) * step:.9f},{force!r}\n" for n, force in enumerate(forces))
    out.write_text("time,force\n" + "".join(rows), encoding="utf-8")
