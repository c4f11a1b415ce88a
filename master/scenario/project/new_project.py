"""A project folder: a scenario of a line and its pantographs, and the definitions that are the user's own.

demo/openpanto.toml               marks the project
demo/README.md                    says what each file is
demo/lines/demo_LN2.toml          own definitions, looked up before the library
demo/pantographs/demo_CX.toml
demo/demo.ssp/                    the scenario: SystemStructure.ssd, a file of parameters for each pantograph
demo/demo.ssp/resources/          its FMUs: those from elsewhere; ours are built there
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

from master.errors import RequestError
from master.fmu.fmu_description import read_fmu
from master.safety.safe_files import write_atomically
from master.scenario.project.port_finding import ENDS, REPLY, Port, Side, check_given, find_ports, own_port
from master.scenario.project.project_page import PROJECT_FILE, ProjectPage, project_text
from master.scenario.project.stretch import Stretch, Wire, contained, early, stretch
from master.scenario.project.system_text import (
    WrittenComponent,
    WrittenConnection,
    WrittenConnector,
    WrittenParameter,
    WrittenSystem,
    ssd_text,
    ssv_text,
)
from master.scenario.start_values import settable
from master.system.components import Fmu

LINE: Final = "catenary"
#: Most pantographs of a train: as many as a line FMU of ours has ports at most.
MOST: Final = 16
#: Of a line whose height changes, and of a pantograph whose reference follows: what may be connected besides.
_RATES: Final = ("nominal.vz", "reference.vz")
_FOLLOWS: Final = "the force is the same at every height, as real pantographs hold it; 0: the spring is on the roof"
#: How far below the lowest contact wire a strip starts [m] (choice).
_BELOW: Final = 0.01
#: Parameters of a pantograph that `--map` may name.
PARAMETERS: Final = ("speed", "start_position", "reference_height", "static_force")
#: Those that the README of a project speaks of, in words.
_SET: Final = {"speed": "speed", "start_position": "start", "static_force": "lifting force"}
_ALLOWED: Final = re.compile(r"[^A-Za-z0-9_]+")
_PORT: Final = re.compile(r"pantograph\[(\d{1,2})\]\.")


@dataclass(frozen=True)
class Definition:
    """A definition of a line or a pantograph that is copied into the project: its name, text, and what it is of."""

    name: str
    text: str
    origin: str


class Lift(NamedTuple):
    """What lifts a pantograph, as whoever knows it says.

    Attributes
    ----------
    parameter, unit : str
    value : float
        As the definition has it.
    can_follow : bool
        Whether ``follow_height`` makes it the force at every height.
    """

    parameter: str
    unit: str
    value: float
    can_follow: bool


@dataclass(frozen=True)
class Request:
    """What is asked for.

    Attributes
    ----------
    folder : Path
    line : Definition or Path
        A definition, or an FMU.
    wire : Wire or None
        Where the line lies; None if that is not known.
    pantographs : sequence of Definition or Path
        The leading one first.
    lifts : mapping
        What lifts the pantographs of these definitions, by their names.
    separations : sequence of float
        From each pantograph to the next one [m]; one number for all.
    speed : float
        [m/s]
    mean_force : float
        Wanted mean contact force [N].
    interval : (float, float), optional
        Of interest [m].
    maps : sequence of (str, str)
        Names of ports and parameters, and the variables of an FMU that they are.
    supply : (str, str)
        Supply system whose limits apply: as limits name it, and in words.
    raised : float
        How long after the start the leading pantograph has been raised [s].
    """

    folder: Path
    line: Definition | Path
    wire: Wire | None
    pantographs: Sequence[Definition | Path]
    lifts: Mapping[str, Lift]
    separations: Sequence[float]
    speed: float
    mean_force: float
    interval: tuple[float, float] | None = None
    maps: Sequence[tuple[str, str]] = ()
    supply: tuple[str, str] = ("AC", "AC")
    raised: float = 0.0


@dataclass(frozen=True)
class _Part:
    """A component: its name, its FMU in the scenario, and that FMU if it comes from elsewhere."""

    name: str
    source: Definition | Path
    fmu: str
    foreign: Fmu | None
    given: Mapping[str, str] = field(default_factory=dict)

    def variable(self, name: str) -> str | None:
        """Return the FMU's own name of a parameter, None if it has none that can be set."""
        if self.foreign is None:
            return name
        variable = self.foreign.variables.get(self.given.get(name, name))
        return variable.name if variable is not None and not settable(variable, "Real") else None

    @property
    def lacking(self) -> list[str]:
        """What a pantograph cannot be set to: where it starts, or how fast it is."""
        return [_SET[name] for name in ("start_position", "speed") if self.variable(name) is None]


def project_name(folder: Path) -> str:
    """Return the name that a project gets from its folder: letters without their accents, digits and _.

    Raises
    ------
    RequestError
        If nothing of the folder's name is left.
    """
    plain = unicodedata.normalize("NFKD", folder.resolve().name)
    name = _ALLOWED.sub("_", "".join(c for c in plain if not unicodedata.combining(c))).strip("_")
    if not name:
        text = "take a folder with letters (A to Z, with accents or without) or digits in its name"
        raise RequestError(f"'{folder}' gives the project no name: {text}")
    return name[:30]


def check_folder(folder: Path) -> None:
    """Refuse a folder that a project cannot be written into."""
    if folder.is_symlink() and not folder.exists():  # to itself, too
        raise RequestError(f"{folder} is a link that leads nowhere: name a new folder")
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise RequestError(f"{there if there == folder else folder.parent} is a file: name a new folder")
    if folder.is_dir() and any(folder.iterdir()):
        raise RequestError(f"{folder} exists and is not empty: name a new folder, or empty it")


def new_project(request: Request) -> Path:
    """Write a project and return the folder of its scenario.

    Raises
    ------
    RequestError
        If it cannot be made; nothing has been written then.
    """
    check_folder(request.folder)
    files = project_files(request)
    for place, data in files.items():
        path = request.folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)
    for folder in ("lines", "pantographs"):
        (request.folder / folder).mkdir(exist_ok=True)
    return request.folder / f"{project_name(request.folder)}.ssp"


def doubt(request: Request) -> str:
    """Return what deserves a second look in a project that can be made, empty if nothing does."""
    way = stretch(request.wire, request.speed, _separations(request), request.interval)
    return early(way, request.speed, request.raised)


def project_files(request: Request) -> dict[str, bytes]:
    """Return the files of a project by their places in its folder."""
    name, count = project_name(request.folder), len(request.pantographs)
    if not 1 <= count <= MOST:
        raise RequestError(f"a train has 1 to {MOST} pantographs, not {count}: give --pantograph as often")
    line, *train = _parts(request)
    way = stretch(request.wire, request.speed, _separations(request), request.interval)
    files = {f"{name}.ssp/{place}": data for place, data in _scenario(name, request, way, line, train).items()}
    definitions = {}
    for part in (line, *train):
        if isinstance(part.source, Definition):
            place = f"{'lines' if part is line else 'pantographs'}/{part.source.name}.toml"
            files[place], definitions[place] = part.source.text.encode(), part.source.origin
    said = ProjectPage(
        name=name,
        folder=request.folder.resolve().name,
        definitions=definitions,
        foreign=tuple(dict.fromkeys(part.fmu for part in (line, *train) if part.foreign is not None)),
        train=tuple(p.name for p in train),
        calibrated=_calibrated(train, request.lifts),
        mean_force=request.mean_force,
        speed=request.speed,
        way=way,
        supply=request.supply[1],
        overlap=contained(request.wire, way),
        values={p.name: text for p in train if (text := ", ".join(w for n, w in _SET.items() if p.variable(n)))},
        own_start={p.name: " and its ".join(lacking) for p in train if (lacking := p.lacking)},
        has_own_lift=any(p.foreign is None for p in train),
    )
    return {**files, PROJECT_FILE: project_text(name).encode(), "README.md": said.text().encode()}


def _separations(request: Request) -> list[float]:
    gaps, given = len(request.pantographs) - 1, list(request.separations)
    if gaps and len(given) == 1:
        return given * gaps
    if len(given) == gaps:
        return given
    if not gaps:
        raise RequestError("--separation: there is one pantograph only; give --pantograph once for each")
    often = "once" if gaps == 1 else f"once, or {gaps} times"
    raise RequestError(f"{gaps + 1} pantographs: give --separation, the distance in m from one to the next, {often}")


def _parts(request: Request) -> list[_Part]:
    """Return the components: the line, and the pantographs, the leading one first."""
    count = len(request.pantographs)
    names = {1: ["pantograph"], 2: ["leading", "trailing"]}.get(count) or [f"pantograph_{k + 1}" for k in range(count)]
    sources = dict(zip((LINE, *names), (request.line, *request.pantographs), strict=True))
    given = _given(request.maps, [name for name, source in sources.items() if isinstance(source, Path)], list(sources))
    found = []
    for name, source in sources.items():
        if isinstance(source, Definition):
            ports = f"_P{count}" if name == LINE and count > 1 else ""
            kind = "Catenary" if name == LINE else "Pantograph"
            found.append(_Part(name, source, f"{kind}_{source.name}{ports}.fmu", None))
        else:
            found.append(_Part(name, source, source.name, _foreign(source), given[name]))
    places: dict[str, Path] = {}
    for part in found:
        if (
            isinstance(part.source, Path)
            and places.setdefault(part.fmu, part.source).resolve() != part.source.resolve()
        ):
            raise RequestError(f"{part.source} and {places[part.fmu]} have one name: rename one of these FMUs")
        if count > 1 and part.name != LINE and part.lacking:
            text = "start_position and speed cannot be set, as a train needs: name the parameters by --map"
            raise RequestError(f"{part.fmu}: {text} start_position=NAME, --map speed=NAME")
    return found


def _foreign(path: Path) -> Fmu:
    if not path.is_file():
        raise RequestError(f"{path}: there is no such FMU")
    try:
        return read_fmu(path)
    except ValueError as error:
        raise RequestError(f"{path} {error}") from error


def _given(maps: Sequence[tuple[str, str]], foreign: Sequence[str], names: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return what `maps` says of each FMU from elsewhere.

    A name may begin with that of a component; if it does not, it is the line's if it begins with a port's, and else
    every pantograph's, or the line's if no pantograph comes from elsewhere.
    """
    found: dict[str, dict[str, str]] = {name: {} for name in foreign}
    pantographs = [name for name in foreign if name != LINE]
    for key, variable in maps:
        owner = next((name for name in names if key.startswith(f"{name}.")), None)
        owners = [owner] if owner else [LINE] if _PORT.match(key) or not pantographs else pantographs
        for name in owners:
            if name not in found:
                text = f"{name} is made from a definition, so its ports are known; --map is for FMUs, X.fmu"
                raise RequestError(f"--map {key}={variable}: {text}")
            found[name][key.removeprefix(f"{name}.")] = variable
    return found


def _ports(part: _Part, side: Side, count: int) -> list[Port]:
    if part.foreign is None:
        return [own_port(f"pantograph[{k + 1}]." if side == "line" else "") for k in range(count)]
    given: dict[tuple[int, str], str] = {}
    for key, variable in part.given.items():
        match = _PORT.match(key)
        name = key[match.end() :] if match else key
        if name in PARAMETERS and side == "pantograph":
            if part.variable(name) is None:
                raise RequestError(f"--map {name}={variable}: {part.fmu} has no parameter '{variable}' that can be set")
            continue
        check_given([name])
        given[int(match[1]) - 1 if match else 0, name] = variable
    return find_ports(part.foreign, side, count, given)


def _scenario(name: str, request: Request, way: Stretch, line: _Part, train: Sequence[_Part]) -> dict[str, bytes]:
    ports = _ports(line, "line", len(train))
    used: list[WrittenConnector] = []
    components: list[WrittenComponent] = []
    connections, files = [], {}
    for pantograph, port, start in zip(train, ports, way.starts, strict=True):
        (strip,) = _ports(pantograph, "pantograph", 1)
        joined = _joined(line, pantograph, port, strip)
        extra = _rate(request, line, pantograph, len(components) + 1)
        joined += extra
        connections += joined
        outputs = {c.output for c in joined if c.start == pantograph.name}
        inputs = {c.input for c in joined if c.end == pantograph.name}
        own = [WrittenConnector(v.name, "output", v.unit) for v in strip.values() if v.name in outputs]
        own += [WrittenConnector(v.name, "input", v.unit) for v in strip.values() if v.name in inputs]
        own += [WrittenConnector(c.input, "input", "m/s") for c in extra]
        used += [WrittenConnector(port[n].name, "input", port[n].unit) for n in ENDS if n in port]
        used += [WrittenConnector(port[n].name, "output", port[n].unit) for n in REPLY if n in port and n in strip]
        used += [WrittenConnector(c.output, "output", "m/s") for c in extra]
        parameters = _parameters(pantograph, request, start)
        file = f"{pantograph.name}.ssv" if parameters else ""
        if file:
            files[file] = ssv_text(pantograph.name, parameters).encode()
        components.append(WrittenComponent(pantograph.name, f"resources/{pantograph.fmu}", own, file))
    for part in (line, *train):
        if isinstance(part.source, Path):
            files[f"resources/{part.fmu}"] = part.source.read_bytes()
    names = " and ".join(dict.fromkeys(_shown(p) for p in train))
    system = WrittenSystem(
        name=name,
        description=f"{names} on {_shown(line)} at {3.6 * request.speed:g} km/h",
        components=[WrittenComponent(LINE, f"resources/{line.fmu}", used), *components],
        connections=connections,
        stop=way.stop,
        interval=way.interval,
        until_end=all(p.variable(name) == name for p in train for name in ("start_position", "speed")),
        calibrated=_calibrated(train, request.lifts),
        mean_force=request.mean_force,
        supply=request.supply[0],
    )
    return {"SystemStructure.ssd": ssd_text(system).encode(), **files}


def _shown(part: _Part) -> str:
    return part.source.name if isinstance(part.source, Definition) else part.source.stem


def _joined(line: _Part, pantograph: _Part, port: Port, strip: Port) -> list[WrittenConnection]:
    """Return the connections of a pantograph: all that the line wants of it, and what it takes of what the line has."""
    found = [WrittenConnection(pantograph.name, strip[n].name, line.name, port[n].name) for n in ENDS if n in port]
    back = [n for n in REPLY if n in port and n in strip]
    return found + [WrittenConnection(line.name, port[n].name, pantograph.name, strip[n].name) for n in back]


def _rate(request: Request, line: _Part, pantograph: _Part, number: int) -> list[WrittenConnection]:
    """Return the connection of the rate of the line's height with a reference that follows, where that changes."""
    if request.wire is None or not request.wire.changes_height or not _follows(pantograph, request):
        return []
    output, rate = f"pantograph[{number}].{_RATES[0]}", _RATES[1]
    return [WrittenConnection(line.name, output, pantograph.name, rate)]


def _follows(part: _Part, request: Request) -> bool:
    return isinstance(part.source, Definition) and request.lifts[part.source.name].can_follow


def _parameters(part: _Part, request: Request, start: float) -> list[WrittenParameter]:
    """Return the values that a pantograph gets: those of ours all, of one from elsewhere what it can be set to."""
    wire = request.wire
    values = [
        WrittenParameter("speed", request.speed, "m/s", f"{3.6 * request.speed:g} km/h"),
        WrittenParameter("start_position", start, "m"),
    ]
    if wire is None:
        values += _first_guess(part, request)
    else:
        height = math.floor(1e3 * (wire.lowest - _BELOW)) / 1e3
        values.append(WrittenParameter("reference_height", height, "m", "10 mm below the lowest contact wire"))
        values += _first_guess(part, request)
    if part.foreign is None:
        return values
    variables = part.foreign.variables
    if (lift := part.variable("static_force")) is not None:
        remark = f"as in the FMU; 'openpanto calibrate' finds the value for a mean force of {request.mean_force:.1f} N"
        values.append(WrittenParameter("static_force", float(variables[lift].start or 0.0), "N", remark))
    known = [(part.variable(v.name), v) for v in values]
    return [v._replace(name=own, unit=v.unit if variables[own].unit else "") for own, v in known if own is not None]


def _first_guess(part: _Part, request: Request) -> list[WrittenParameter]:
    """Return what gives about the wanted mean force at every height; a moment is left as the definition has it."""
    if not isinstance(part.source, Definition):
        return []
    lift = request.lifts[part.source.name]
    remark = f"'openpanto calibrate' finds the value for a mean force of {request.mean_force:.1f} N"
    if lift.unit != "N":
        return [WrittenParameter(lift.parameter, lift.value, lift.unit, f"as in the definition; {remark}")]
    force = WrittenParameter(lift.parameter, round(request.mean_force, 1), lift.unit, f"a first guess; {remark}")
    return [force, WrittenParameter("follow_height", 1, "1", _FOLLOWS)] if lift.can_follow else [force]


def _calibrated(train: Sequence[_Part], lifts: Mapping[str, Lift]) -> str:
    """Return the parameter that a calibration changes, empty if the leading pantograph has none."""
    first = train[0]
    name = (
        lifts[first.source.name].parameter if isinstance(first.source, Definition) else first.variable("static_force")
    )
    return f"{first.name}.{name}" if name else ""
