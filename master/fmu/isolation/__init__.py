"""FMUs in processes of their own: what crashes there does not take the run along.

`IsolatedInstance` stands in for `Instance`; behind it a child process (``python -m master.fmu.isolation``) holds the
real one. They talk over a socket in frames of a fixed layout (`channel`); nothing that the child says is ever executed.
"""
