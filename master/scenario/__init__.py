"""From the files of a scenario to a system that can be run: opened, overridden, checked.

Imports fmu, system, ssp and safety. It is larger than other rooms for its checks, each in words of its own.
"""
