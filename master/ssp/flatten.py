"""Nested systems as one flat list of components: connections are followed through the systems' connectors.

A component of a nested system is named by its path, ``train.pantograph``, as SSP names parameters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from master.errors import hint
from master.ssp.ssd_elements import Binding, Component, Connection, Connector, Feed, Joint, Leg, Stop, SystemNode
from master.ssp.ssp_xml import Reader

#: Owner (its path, empty for the whole) and connector.
_Place = tuple[str, str]
#: Kinds of connectors whose values change during the run, and of those that have theirs before it.
_SIGNALS = ("input", "output")
_PARAMETERS = ("parameter", "calculatedParameter")
_GIVING = ("output", "calculatedParameter")


@dataclass(frozen=True)
class Flat:
    """A system without nesting.

    Attributes
    ----------
    components, connections, bindings : tuple
    feeds : tuple of Feed
        What leads to components through the connectors of systems, fed or not.
    connectors : dict
        The systems' own connectors, by their full names.
    joints : tuple of Joint
        Every connection that touches a system's connector, wherever it leads.
    """

    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    bindings: tuple[Binding, ...]
    feeds: tuple[Feed, ...]
    connectors: dict[str, Connector]
    joints: tuple[Joint, ...]


@dataclass(frozen=True)
class _Edge:
    """A connection between two places, in the direction in which values go."""

    source: _Place
    target: _Place
    connection: Connection
    giving: Connector
    taking: Connector


def flatten(root: SystemNode, reader: Reader) -> Flat:
    """Return the components, connections and bindings of a system and of all systems in it."""
    systems = dict(_systems(root, ""))
    components = tuple(replace(c, name=_join(path, c.name)) for path, s in systems.items() for c in s.components)
    direct, edges = _connections(systems, reader)
    _report_ends(edges, systems, reader)
    followed, feeds = _followed(edges, systems)
    own = {_join(path, x.name): x for path, s in systems.items() for x in s.connectors}
    joints = tuple(_joint(e, systems) for e in edges)
    return Flat(components, (*direct, *followed), _bindings(systems), feeds, own, joints)


def _systems(system: SystemNode, path: str) -> Iterator[tuple[str, SystemNode]]:
    yield path, system
    for nested in system.systems:
        yield from _systems(nested, _join(path, nested.name))


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _bindings(systems: dict[str, SystemNode]) -> tuple[Binding, ...]:
    """Return the systems' bindings, inner ones first: those of the outer systems take priority."""
    found: list[Binding] = []
    for path in sorted(systems, key=lambda p: -_depth(p, systems)):
        found += [replace(b, prefix=f"{path}." + b.prefix if path else b.prefix) for b in systems[path].bindings]
    return tuple(found)


def _depth(path: str, systems: dict[str, SystemNode]) -> int:
    return sum(1 for other in systems if other and (path == other or path.startswith(f"{other}.")))


def _connections(systems: dict[str, SystemNode], reader: Reader) -> tuple[list[Connection], list[_Edge]]:
    """Return the connections between components as they are, and those that touch a system's connector."""
    direct, edges = [], []
    for path, system in systems.items():
        inside = {*(x.name for x in system.components), *(x.name for x in system.systems)}
        for c in system.connections:
            if _leads_out(c, inside, system.name, reader):
                continue
            ends = [(c.start_element, c.start_connector), (c.end_element, c.end_connector)]
            touched = [_system_at(path, element, systems) for element, _ in ends]
            if touched == [None, None]:
                start, end = (_join(path, element) for element, _ in ends)
                direct.append(replace(c, start_element=start, end_element=end))
            elif (edge := _edge(path, c, systems, reader)) is not None:
                edges.append(edge)
    return direct, edges


def _leads_out(c: Connection, inside: set[str], system: str, reader: Reader) -> bool:
    """Report a connection to an element inside another system; only that system itself can be connected."""
    for element in (c.start_element, c.end_element):
        if "." in element and element not in inside:
            text = f"'{element}' is not a component or system in system '{system}'; connect the system that holds it"
            reader.report(c.line, "connection", text)
            return True
    return False


def _system_at(path: str, element: str, systems: dict[str, SystemNode]) -> str | None:
    """Return the path of the system that an element's name stands for, None if it is no system."""
    found = _join(path, element) if element else path
    return found if found in systems else None


def _edge(path: str, c: Connection, systems: dict[str, SystemNode], reader: Reader) -> _Edge | None:
    ends = []
    for element, name in ((c.start_element, c.start_connector), (c.end_element, c.end_connector)):
        place = (_join(path, element) if element else path, name)
        connector = _connector(path, element, name, systems)
        if connector is None:
            what = f"'{element}' has no connector '{name}'" if element else f"the system has no connector '{name}'"
            near = hint(name, (x.name for x in _connectors(path, element, systems)))
            reader.report(c.line, "connection", what + near)
            return None
        if connector.kind not in (*_SIGNALS, *_PARAMETERS):
            text = f"connects '{name}' of kind '{connector.kind}', which is not supported"
            reader.report(c.line, "unsupported", text)
            return None
        # From the inside, a system's own input gives values and its own output takes them.
        ends.append((place, connector, (connector.kind in _GIVING) == bool(element)))
    (first, one, first_gives), (second, other, second_gives) = ends
    if (one.kind in _PARAMETERS) != (other.kind in _PARAMETERS):
        kinds = f"'{first[1]}' of kind '{one.kind}' and '{second[1]}' of kind '{other.kind}'"
        reader.report(c.line, "connection", f"connects {kinds}, which do not fit")
        return None
    if first_gives == second_gives:
        both = "give" if first_gives else "take"
        reader.report(c.line, "connection", f"'{first[1]}' and '{second[1]}' both {both} values")
        return None
    return _Edge(first, second, c, one, other) if first_gives else _Edge(second, first, c, other, one)


def _connector(path: str, element: str, name: str, systems: dict[str, SystemNode]) -> Connector | None:
    return next((x for x in _connectors(path, element, systems) if x.name == name), None)


def _connectors(path: str, element: str, systems: dict[str, SystemNode]) -> tuple[Connector, ...]:
    system = _system_at(path, element, systems)
    if system is not None:
        return systems[system].connectors
    return next((c.connectors for c in systems[path].components if c.name == element), ())


def _followed(edges: list[_Edge], systems: dict[str, SystemNode]) -> tuple[list[Connection], tuple[Feed, ...]]:
    """Return a connection for every connector of a component that others reach through systems, and what leads there.

    A way that begins at a connector of a system, which nothing feeds, makes no connection: its values hold.
    """
    into, connections, feeds = _into(edges), [], []
    for last in edges:
        if last.target[0] in systems or (chain := _chain(last, into, systems)) is None:
            continue
        is_fed = chain[0].source[0] not in systems
        feeds.append(Feed(*last.target, _stops(chain, systems), is_fed))
        if is_fed:
            connections.append(_whole(chain, systems))
    return connections, tuple(feeds)


def _into(edges: list[_Edge]) -> dict[_Place, list[_Edge]]:
    """Return the connections that lead to each place."""
    into: dict[_Place, list[_Edge]] = {}
    for edge in edges:
        into.setdefault(edge.target, []).append(edge)
    return into


def _chain(last: _Edge, into: dict[_Place, list[_Edge]], systems: dict[str, SystemNode]) -> list[_Edge] | None:
    """Return the connections that lead to a component one after the other, None if they are not sound."""
    chain = [last]
    while chain[0].source[0] in systems and (before := into.get(chain[0].source, [])):
        if len(before) != 1 or len(chain) > len(into):
            return None
        chain.insert(0, before[0])
    return chain


def _whole(chain: list[_Edge], systems: dict[str, SystemNode]) -> Connection:
    first, last = chain[0], chain[-1]
    return replace(
        last.connection,
        start_element=first.source[0],
        start_connector=first.source[1],
        end_element=last.target[0],
        end_connector=last.target[1],
        before=tuple(_leg(e, systems) for e in chain[:-1]),
    )


def _stops(chain: list[_Edge], systems: dict[str, SystemNode]) -> tuple[Stop, ...]:
    """Return the systems' connectors on the way, each with what is left of it."""
    legs = [_leg(e, systems) for e in chain]
    found = []
    for i, edge in enumerate(chain):
        path, name = edge.source
        if path in systems:
            found.append(Stop(path, next(x for x in systems[path].connectors if x.name == name), tuple(legs[i:])))
    return tuple(found)


def _leg(edge: _Edge, systems: dict[str, SystemNode]) -> Leg:
    """Return a connection; where it ends at a system's connector, its value has that one's unit from there on."""
    path, name = edge.target
    unit = next(x.unit for x in systems[path].connectors if x.name == name) if path in systems else ""
    c = edge.connection
    return Leg(unit, c.transformation, c.suppress_unit_conversion, c.line)


def _joint(edge: _Edge, systems: dict[str, SystemNode]) -> Joint:
    component, other = ("" if owner in systems else owner for owner, _ in (edge.source, edge.target))
    c = edge.connection
    return Joint(component, edge.giving, other, edge.taking, c.suppress_unit_conversion, c.line)


def _report_ends(edges: list[_Edge], systems: dict[str, SystemNode], reader: Reader) -> None:
    """Report connectors of systems that several connections feed, or that feed themselves, wherever they lead."""
    into = {place: before for place, before in _into(edges).items() if place[0] in systems}
    reported: set[_Place] = set()
    for place, before in into.items():
        if len(before) > 1:
            text = f"has {len(before)} connections; one is allowed"
        elif place not in reported and place in (circle := _ahead(place, into)):
            text = "is fed by itself: the connections of systems form a circle, into which no component leads"
            reported.update(circle)
        else:
            continue
        where = f"connector '{place[1]}' of system '{place[0] or systems[''].name}'"
        reader.report(before[0].connection.line, "connection", f"{where} {text}")


def _ahead(place: _Place, into: dict[_Place, list[_Edge]]) -> list[_Place]:
    """Return the connectors of systems that lead to one, itself among them if it is fed by itself."""
    found: list[_Place] = []
    while place in into and into[place][0].source not in found:
        place = into[place][0].source
        found.append(place)
    return found
