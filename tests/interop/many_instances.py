"""Make instances of an FMU one after another, in a separate process: ``many_instances.py FMU COUNT WARM-UP``.

Prints a JSON object: what an instance after the warm-up has left behind [kB], and what there is at the end of entries
in ``sys.path``, of open files and of mapped pieces of files, beside what there was after the warm-up.
"""

from __future__ import annotations

import ctypes
import gc
import json
import re
import sys
from pathlib import Path

import numpy as np

from master.fmu.fmu_description import read_fmu
from master.fmu.instance import Instance
from master.system.components import Component


def main(path: str, count: int, warm_up: int) -> None:
    fmu = read_fmu(Path(path))
    component = Component("part", fmu, {}, (), tuple(n for n, v in fmu.variables.items() if v.causality == "output"))
    for _ in range(warm_up):
        use(component)
    before = counts()
    for _ in range(count - warm_up):
        use(component)
    after = counts()
    left = (after.pop("memory") - before.pop("memory")) / (count - warm_up)
    print(json.dumps({"left": left, "before": before, "after": after}))


def use(component: Component) -> None:
    """Take an instance from its beginning to its end, with a step and a saved state."""
    outputs = np.zeros(len(component.outputs))
    instance = Instance(component)
    instance.bind(np.zeros(0), outputs)
    instance.start(0.0, 1.0)
    instance.finish_initialisation()
    state = instance.save()
    instance.step(0.0, 1e-3)
    instance.restore(state)
    instance.release(state)
    instance.read()
    assert np.isfinite(outputs).all()
    instance.close()


def counts() -> dict[str, float]:
    """Count what an instance could leave behind.

    Memory is what the process holds for itself once the C library has given back what is free: pieces of files come
    and go as the machine has room, and freed memory stays until the library finds it worth giving back.
    """
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    held = re.search(r"^RssAnon:\s+(\d+) kB$", Path("/proc/self/status").read_text(encoding="ascii"), re.MULTILINE)
    assert held
    return {
        "memory": float(held[1]),
        "path": len(sys.path),
        "modules": len(sys.modules),
        "files": sum(1 for _ in Path("/proc/self/fd").iterdir()),
        "maps": sum(".so" in line for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()),
    }


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
