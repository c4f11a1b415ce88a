"""FMUs of the toy part, and a small way to drive an FMU through fmpy."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import fmpy
import pytest
from fmpy import calloc, free
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

from fmus.builder.recipe import ROOTS, Recipe
from models.library.catalogue import line_path

TOY = Path(__file__).parent / "toy"


def refused():
    """Expect a call that returns fmi2Error, neither more nor less."""
    return pytest.raises(FMICallException, match=r"failed with status 3 \(error\)")


class Instance:
    """An instantiated FMU: values by name, and everything it logged."""

    def __init__(self, path: Path, name: str = "part", unzipped: str | None = None) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.folder = unzipped or fmpy.extract(str(path))
        self.messages: list[tuple[int, str]] = []
        self.slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate(callbacks=self._callbacks(), loggingOn=True)

    def _callbacks(self):
        def log(_environment, _instance, status, _category, message):
            self.messages.append((status, message.decode()))

        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(log)
        callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        self._kept = callbacks  # fmpy keeps no reference
        return callbacks

    def __getitem__(self, name: str) -> float:
        return self.slave.getReal([self.references[name]])[0]

    def __setitem__(self, name: str, value: float) -> None:
        if isinstance(value, int):
            self.slave.setInteger([self.references[name]], [value])
        else:
            self.slave.setReal([self.references[name]], [value])

    def get(self, names: list[str]) -> list[float]:
        return self.slave.getReal([self.references[n] for n in names])

    def initialise(self, start: float = 0.0, **values: float) -> None:
        self.slave.setupExperiment(startTime=start)
        self.slave.enterInitializationMode()
        for name, value in values.items():
            self[name] = value
        self.slave.exitInitializationMode()

    def step(self, time: float, step: float = 1e-3) -> None:
        self.slave.doStep(time, step)

    def run(self, steps: int, first: int = 0) -> list[list[float]]:
        """Step under a changing force and return the observed values after every step."""
        rows = []
        for n in range(first, first + steps):
            self["force"] = 1.0 + 0.01 * n
            self.step(n * 1e-3)
            rows.append(self.get(["mass[1].z", "mass[2].z", "spring[1].force"]))
        return rows

    @property
    def errors(self) -> list[str]:
        return [text for status, text in self.messages if status >= 3]

    @property
    def warnings(self) -> list[str]:
        return [text for status, text in self.messages if status == 1]

    def free(self) -> None:
        self.slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


def toy_recipe(folder: Path = TOY, name: str = "Toy", **changes: object) -> Recipe:
    return Recipe(
        name,
        "Masses on springs",
        "toy.slave",
        "ToySlave",
        folder / "toy.toml",
        roots={**ROOTS, "toy": folder},
        **changes,
    )


def toy_variant(folder: Path, old: str, new: str, file: str = "law.py") -> Path:
    """Return a copy of the toy's sources in which one text differs."""
    copy = folder / "toy"
    shutil.copytree(TOY, copy)
    text = (copy / file).read_text()
    assert old in text
    (copy / file).write_text(text.replace(old, new))
    return copy


def names_of(instance: Instance, *causalities: str) -> list[str]:
    return [v.name for v in instance.description.modelVariables if v.causality in causalities]


def run(instance: Instance, steps: range, observed: list[str]) -> list[list[float]]:
    rows = []
    for n in steps:
        for name, value in zip(*push(instance, n), strict=True):
            instance[name] = value
        instance.step(n * 1e-3)
        rows.append(instance.get(observed))
    return rows


def push(instance: Instance, n: int) -> tuple[list[str], list[float]]:
    """Return inputs that change from step to step: a strip that rises into the wire, or a force."""
    if "contact.force" in instance.references:
        return ["contact.force", "contact.x"], [100.0 + n, 0.08 * n]
    names, values = [], []
    height = instance["support[3].z"] - 0.05 + 0.002 * n
    for end, y in (("A", 0.7), ("B", -0.7)):
        names += [f"pantograph[1].{end}.{axis}" for axis in ("x", "y", "z", "vx", "vz")]
        values += [instance["support[3].x"] + 30.0 + 0.08 * n, y, height, 80.0, 2.0]
    return names, values


def short_line_recipe(folder: Path, lengths: str = "", pantographs: int = 1, more: str = "") -> Recipe:
    """Return the recipe of LN2 with five spans of 50 m, on droppers of given lengths if wanted, with more tables."""
    text = line_path("LN2").read_text(encoding="utf-8")
    spans = '[spans]\nstart = [0, "m", "test"]\ncount = 5\nlength = [50, "m", "test"]\n'
    text = re.sub(r"\[spans\]\n.*?(?=\n\[)", spans, text, count=1, flags=re.DOTALL)
    if lengths:
        text = text.replace("[spans.droppers]\n", f'[spans.droppers]\nlengths = [{lengths}, "m", "test"]\n')
    (folder / "Short.toml").write_text(text + more, encoding="utf-8")
    settings = {"pantographs": pantographs}
    return Recipe(
        "Catenary_Short", "short", "fmus.slave.catenary_slave", "CatenarySlave", folder / "Short.toml", settings
    )
