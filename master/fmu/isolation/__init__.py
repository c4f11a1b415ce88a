"""FMUs in separate processes: what crashes there does not take the run with it.

`IsolatedInstance` stands in for `Instance`; behind it a child process (``python -m master.fmu.isolation``) holds the
real one. They talk over a socket in frames of a fixed layout (`channel`); nothing that the child says is ever executed.
"""
