"""An FMU that misbehaves on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from pythonfmu.builder import FmuBuilder

from master.fmu.fmu_description import read_fmu
from master.fmu.isolation.isolated_instance import IsolatedInstance, Isolation
from master.system.components import Component

CRASHER = '''
import ctypes
import os
import stat
import sys
import time as clock
from pythonfmu import Fmi2Causality as C, Fmi2Slave, Fmi2Variability as V, Integer, Real

def chatter():
    for _ in range(200):
        print("garbage " * 20)
    sys.stdout.flush()
    os.write(1, bytes(range(256)))

def last_words():
    print("the roof is on fire", flush=True)
    os._exit(3)

def is_socket(fd):
    try:
        return stat.S_ISSOCK(os.fstat(fd).st_mode)
    except OSError:
        return False

def meet():
    """Wait for another one that does the same."""
    folder = os.environ["TOY_MEETING"]
    open(os.path.join(folder, str(os.getpid())), "w").close()
    deadline = clock.monotonic() + 20.0
    while len(os.listdir(folder)) < 2:
        if clock.monotonic() > deadline:
            raise RuntimeError("nobody came")
        clock.sleep(0.001)

DEEDS = {
    1: lambda: ctypes.string_at(0),
    2: last_words,
    3: lambda: clock.sleep(1e3),
    4: os.abort,
    5: chatter,
    6: lambda: os._exit(0),
    7: lambda: os.closerange(3, 50),
    8: lambda: [os.write(int(fd), b"x" * 64) for fd in os.listdir("/proc/self/fd") if is_socket(int(fd))],
    9: meet,
    10: lambda: all(iter(lambda: True, None)),
}

class Crasher(Fmi2Slave):
    """Adds up its input; does one of its deeds when its time has come."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        if os.environ.get("TOY_REFUSES"):
            raise RuntimeError("no paper in the tray")
        self.deed = 0
        self.at = 0.0
        self.gain = 1.0
        self.u = 0.0
        self.sum = 0.0
        self.register_variable(Integer("deed", causality=C.parameter, variability=V.tunable))
        for name in ("at", "gain"):
            self.register_variable(Real(name, causality=C.parameter, variability=V.tunable))
        self.register_variable(Real("u", causality=C.input, start=0.0))
        self.register_variable(Real("sum", causality=C.output))
        self.register_variable(Real("double", causality=C.local, getter=lambda: 2.0 * self.sum))
        self.register_variable(Real("pid", causality=C.local, getter=lambda: float(os.getpid())))

    def do_step(self, time, step):
        if self.deed and time >= self.at:
            DEEDS[self.deed]()
        self.sum += self.gain * self.u
        return self.sum < 100.0
'''


@pytest.fixture(scope="session")
def crasher_fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("crasher")
    script = folder / "toy_crasher_script.py"
    script.write_text(CRASHER)
    FmuBuilder.build_FMU(script, dest=folder, canGetAndSetFMUstate=True, canSerializeFMUstate=True)
    return folder / "Crasher.fmu"


@pytest.fixture
def crasher(crasher_fmu: Path) -> Callable[..., Component]:
    """Function that gives the component ``toy`` with parameters."""
    fmu = read_fmu(crasher_fmu)
    return lambda **parameters: Component("toy", fmu, parameters, ("u",), ("sum",))


Started = tuple[IsolatedInstance, np.ndarray, np.ndarray]


@pytest.fixture
def isolate(crasher: Callable[..., Component]) -> Iterator[Callable[..., Started]]:
    """Function that starts an isolated toy; gives it with the arrays of its inputs and outputs."""
    made: list[IsolatedInstance] = []

    def start(step_timeout: float | None = None, **parameters: float) -> Started:
        instance = IsolatedInstance(crasher(**parameters), Isolation(step_timeout))
        made.append(instance)
        inputs, outputs = np.zeros(1), np.zeros(1)
        instance.bind(inputs, outputs)
        instance.start(0.0, 1.0)
        instance.finish_initialisation()
        return instance, inputs, outputs

    yield start
    for instance in made:
        instance.close()
