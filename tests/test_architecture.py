"""Who may import whom, held for every import: those inside functions and those for types included.

A room may import itself and the rooms of earlier tiers of its list; rooms of one tier do not know each other.
docs/architecture.md shows the same lists with every room's duty, and is compared with them and with the tree.
"""

from __future__ import annotations

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from fmus.builder.source_bundle import OPTIONAL, REQUIREMENTS

ROOT = Path(__file__).parents[1]
PACKAGES = ("models", "fmus", "master")

#: The rooms (folders, or files that stand for one) of each folder that is laid out in tiers, from the ground up.
TIERS: dict[str, list[set[str]]] = {
    "models": [
        {"arrays", "scipy_start"},
        {"definition_files", "numerics", "contact_law"},
        {"catenary", "pantograph", "signals"},
        {"library", "coupled"},
        {"layout"},
        {"interface"},
        {"commands"},
        {"__main__"},
    ],
    "models.catenary": [
        {"definition"},
        {"shape"},
        {"linear_motion", "condition"},
        {"contact_and_slack", "line_state"},
        {"step", "exchange"},
        {"line_model"},
        {"statics", "line_energy", "strip_checks"},
        {"line_part", "line_advice"},
    ],
    "models.pantograph": [
        {"train_motion", "working_height", "excursions"},
        {"operation"},
        {"lumped", "multibody"},
        {"identification"},
    ],
    "models.pantograph.multibody": [
        {"mechanism_definition", "base_motion"},
        {"mechanism_reading", "elements"},
        {"mechanism"},
        {"mechanism_assembly", "mechanism_energy", "last_found"},
        {"analysis", "mechanism_integrator"},
        {"mechanism_advice", "step_memory", "range_watch", "reduced"},
        {"compiled"},
        {"multibody_part"},
    ],
    "fmus": [{"slave", "loader"}, {"builder"}, {"__main__"}],
    "master": [
        {"errors", "arrays"},
        {"safety"},
        {"ssp"},
        {"system"},
        {"fmu", "coupling"},
        {"scenario", "recording"},
        {"evaluation"},
        {"results"},
        {"report", "run_session"},
        {"batch"},
        {"interface"},
        {"commands"},
        {"__main__"},
    ],
}

#: Between packages. What the physics' commands share with the master needs numpy alone.
MAY_IMPORT = {"models": set(), "fmus": {"models"}, "master": set()}
SHARED = {"master.evaluation.filters", "master.evaluation.contact_quality"}

#: Outside packages that only some places may import.
ONLY_IN = {
    "numba": lambda name: name.endswith("_kernels"),
    "llvmlite": lambda name: name.endswith("_kernels"),
    "fmpy": lambda name: name.startswith("master.fmu."),
    "lxml": lambda name: name.startswith("master.ssp."),
    "pythonfmu": lambda name: name.startswith("fmus."),
    "dask": lambda name: name in ("master.batch.sweep.dask_engine", "master.batch.sweep.local_cluster"),
    "distributed": lambda name: name in ("master.batch.sweep.dask_engine", "master.batch.sweep.local_cluster"),
    "SALib": lambda name: name == "master.batch.sweep.sensitivity",
    "matplotlib": lambda name: name.startswith(
        ("models.commands.", "models.layout.", "master.report.", "master.interface.")
    ),
    "ezdxf": lambda name: name == "models.layout.drawing_export",
    "openpyxl": lambda name: name == "models.layout.xlsx_sheets",
    "pandas": lambda name: name.startswith(("models.interface.", "master.interface.")),
}
#: What runs inside an FMU: all of models but these, and fmus/slave.
OUTSIDE_FMU = ("models.commands", "models.interface", "models.layout", "models.__main__")


@cache
def modules() -> dict[str, Path]:
    """Return the files of all packages by the name under which they are imported."""
    found = {}
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def import_statements(path: Path) -> list[ast.Import | ast.ImportFrom]:
    """Return the imports of a file, wherever they stand."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def imported(path: Path) -> Iterator[str]:
    """Yield every module (or name in one) that a file imports, wherever the import stands."""
    for node in import_statements(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif node.module:
            assert node.level == 0, f"{path}: relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def module_of(name: str) -> str | None:
    """Return the module of ours that an imported name belongs to, or None for a package from outside."""
    while name:
        if name in modules():
            return name
        name = name.rpartition(".")[0]
    return None


@cache
def arrows() -> dict[str, set[str]]:
    """Return which modules of ours each module imports."""
    return {name: {m for n in imported(path) if (m := module_of(n)) and m != name} for name, path in modules().items()}


def outside() -> Iterator[tuple[str, str]]:
    for name, path in modules().items():
        for found in imported(path):
            if module_of(found) is None and found.split(".")[0] not in sys.stdlib_module_names:
                yield name, found.split(".")[0]


def test_packages_import_only_what_they_may():
    wrong = set()
    for name, targets in arrows().items():
        package = name.split(".")[0]
        for target in targets:
            other = target.split(".")[0]
            allowed = other == package or other in MAY_IMPORT[package]
            if not allowed and not (name.startswith("models.commands.") and target in SHARED):
                wrong.add(f"{name} -> {target}")
    assert not wrong


def tier_breaks(folder: str) -> set[str]:
    tier = {room: k for k, rooms in enumerate(TIERS[folder]) for room in rooms}
    wrong = set()
    depth = len(folder.split("."))
    for name, targets in arrows().items():
        if not name.startswith(folder + "."):
            continue
        room = name.split(".")[depth]
        for target in targets:
            if not target.startswith(folder + "."):
                continue
            other = target.split(".")[depth]
            if other != room and tier.get(other, 99) >= tier.get(room, -1):
                wrong.add(f"{name} -> {target}")
    return wrong


@pytest.mark.parametrize("folder", sorted(TIERS))
def test_rooms_import_only_from_earlier_tiers(folder):
    assert sorted(tier_breaks(folder)) == []


@pytest.mark.parametrize("folder", sorted(TIERS))
def test_every_room_is_in_the_table(folder):
    named = set().union(*TIERS[folder])
    path = ROOT / folder.replace(".", "/")
    there = {p.stem if p.suffix == ".py" else p.name for p in path.iterdir() if p.suffix == ".py" or p.is_dir()}
    there -= {"__init__", "__pycache__"}
    assert sorted({f"{room} is in no tier" for room in there - named}) == []


def test_there_is_no_circle_of_files():
    graph, state, wrong = arrows(), {}, set()

    def visit(name: str, way: tuple[str, ...]) -> None:
        state[name] = "open"
        for target in sorted(graph[name]):
            if state.get(target) == "open":
                circle = way[way.index(target) :] if target in way else (target, name)
                wrong.add(" -> ".join(sorted(circle)))
            elif target not in state:
                visit(target, (*way, target))
        state[name] = "done"

    for name in sorted(graph):
        if name not in state:
            visit(name, (name,))
    assert sorted(wrong) == []


def test_file_names_are_unique():
    places = defaultdict(list)
    for name in modules():
        places[name.split(".")[-1]].append(name)
    wrong = {
        f"{leaf}: {', '.join(sorted(names))}"
        for leaf, names in places.items()
        if len([n for n in names if modules()[n].name != "__init__.py"]) > 1 and leaf not in {"__main__", "arrays"}
    }
    assert len(places) > 150
    assert sorted(wrong) == []


def test_the_command_knows_the_packages_and_nobody_knows_the_command():
    tree = ast.parse((ROOT / "openpanto.py").read_text(encoding="utf-8"))
    at_once = {node.module for node in tree.body if isinstance(node, ast.ImportFrom)} & set(modules())
    assert at_once == {"master.errors", "master.safety.supervision"}
    ours = {n for n in imported(ROOT / "openpanto.py") if n.split(".")[0] not in sys.stdlib_module_names}
    assert {n for n in ours if module_of(n) is None} == {"shtab"}
    assert not [name for name, path in modules().items() if "openpanto" in set(imported(path))]


def test_rooms_say_their_duty_and_hand_nothing_on():
    """An ``__init__.py`` holds a docstring alone, but for the public faces of the packages."""
    wrong = set()
    for name, path in modules().items():
        if path.name != "__init__.py" or name in PACKAGES:
            continue
        body = ast.parse(path.read_text(encoding="utf-8")).body
        if len(body) != 1 or not (isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant)):
            wrong.add(f"{name} holds more than a docstring")
        elif len(str(body[0].value.value)) < 40:
            wrong.add(f"{name} does not say its duty")
    assert sorted(wrong) == []


def test_outside_packages_stay_where_they_belong():
    wrong = {f"{name} -> {what}" for name, what in outside() if what in ONLY_IN and not ONLY_IN[what](name)}
    assert sorted(wrong) == []


def test_what_runs_inside_an_fmu_needs_numpy_and_scipy_alone():
    inside = [n for n in modules() if n.startswith("models") and not n.startswith(OUTSIDE_FMU)]
    assert len(inside) > 40
    # As the builder has it, which refuses all others: what this test lets through can be built.
    wrong = {f"{n} -> {what}" for n, what in outside() if n in inside and what not in {*REQUIREMENTS, *OPTIONAL}}
    assert wrong == set()


def test_what_the_physics_commands_share_needs_numpy_alone():
    todo, seen = set(SHARED), set()
    while todo:
        name = todo.pop()
        seen.add(name)
        todo |= arrows()[name] - seen
    wrong = {f"{n} -> {what}" for n, what in outside() if n in seen and what != "numpy"}
    assert wrong == set()
    assert seen <= SHARED | {"master.arrays", "master", "master.evaluation"}


# The page

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def page_tiers() -> dict[str, list[set[str]]]:
    """Return the lists of the page: a folder, and below it its rooms, each with the number of its tier and its duty."""
    found: dict[str, list[set[str]]] = {}
    for line in PAGE.splitlines():
        if heading := re.fullmatch(r"    ([a-z_/]+)/", line):
            tiers = found[heading[1].replace("/", ".")] = []
        elif row := re.fullmatch(r"    \s*(\d+) (\w+)\s+(\S.*)", line):
            assert int(row[1]) in (len(tiers), len(tiers) + 1), f"out of order: {line}"
            tiers += [set()] * (int(row[1]) - len(tiers))
            tiers[-1] = tiers[-1] | {row[2]}
    return found


def test_the_page_shows_the_lists_that_are_held():
    assert page_tiers() == TIERS


def test_the_page_covers_every_module():
    """A module is a row or lies in a room that is one; a room within a room is a row or named ``room/`` in its text."""
    rows = {f"{folder}.{room}" for folder, tiers in page_tiers().items() for rooms in tiers for room in rooms}
    for name, path in modules().items():
        if name in PACKAGES:
            continue
        parts = name.split(".")
        assert any(".".join(parts[:k]) in rows for k in range(2, len(parts) + 1)), name
        assert path.name != "__init__.py" or name in rows or f"{parts[-1]}/" in PAGE, name


def test_the_page_names_no_file_that_is_not_there():
    """What stands in backticks with a folder, or as several words, is a file of ours or ends the path of one."""
    paths = [p for package in (*PACKAGES, "tests") for p in (ROOT / package).rglob("*")]
    files = {f"/{p.relative_to(ROOT).as_posix()}" for p in (*ROOT.glob("*"), *paths)}
    files |= {f.removesuffix(".py") for f in files}
    named = {n for n in re.findall(r"`([\w/.]+)`", PAGE) if "/" in n or re.fullmatch(r"[a-z]+_[a-z0-9_]+", n)}
    assert len(named) > 40
    assert {n for n in named if not any(f.endswith(f"/{n}") for f in files)} == {"with_values"}
