"""FMUs of a system loaded together, and freed together whatever happens."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from master.errors import RunError
from master.fmu.instance import Instance
from master.fmu.isolation.isolated_instance import IsolatedInstance, Isolation
from master.safety.interruption import interruptible_at_once
from master.safety.supervision import phase
from master.system.components import Component


@contextmanager
def loaded_fmus(
    components: Sequence[Component], isolation: Isolation | None = None, troubles: dict[str, str] | None = None
) -> Iterator[list[Instance | IsolatedInstance]]:
    """Load the FMUs of components; they are freed at the end.

    Parameters
    ----------
    components : sequence of Component
    isolation : Isolation, optional
        Given if each is to have its own process.
    troubles : dict, optional
        Takes what goes wrong when they are freed, by component.

    Raises
    ------
    RunError
        If an FMU cannot be loaded, or not as often as the system has it.
    """
    instances: list[Instance | IsolatedInstance] = []
    if isolation is None:
        _check_single(components)
    try:
        with phase("loading"), interruptible_at_once():
            for component in components:
                # One by one: those loaded so far must be freed on failure.
                instance = Instance(component) if isolation is None else IsolatedInstance(component, isolation)
                instances.append(instance)
        yield instances
    finally:
        with phase("closing"):
            _free(instances, {} if troubles is None else troubles)


def _check_single(components: Sequence[Component]) -> None:
    """Refuse several instances of an FMU of which a process can hold only one."""
    first: dict[str, str] = {}
    for c in components:
        if c.fmu.is_single and (other := first.setdefault(c.fmu.sha256, c.name)) != c.name:
            text = f"both are of {c.fmu.path.name}, of which a process can hold only one; --isolate gives each its own"
            raise RunError(f"components '{other}' and '{c.name}': {text}")


def _free(instances: Sequence[Instance | IsolatedInstance], troubles: dict[str, str]) -> None:
    """Free all, also after one at which the user lost patience."""
    interruption = None
    for instance in reversed(instances):
        try:
            with interruptible_at_once():
                said = instance.close()
        except KeyboardInterrupt as error:
            interruption = error
            continue
        if said:
            troubles[instance.name] = said
    if interruption is not None:
        raise interruption
