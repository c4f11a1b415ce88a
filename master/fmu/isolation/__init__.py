"""FMUs in processes of their own: what crashes there does not take the run along.

`IsolatedInstance` stands in for `Instance`; behind it a child process (``python -m master.fmu.isolation``) holds the
real one. They talk over a socket in frames of a fixed layout (`wire`); nothing that the child says is ever executed.
"""

from master.fmu.isolation.isolated_instance import INIT_TIMEOUT, IsolatedInstance, Isolation

__all__ = ["INIT_TIMEOUT", "IsolatedInstance", "Isolation"]
