"""SSP 1.0 files as they are written: archives, structures, parameter sets and mappings, units, the settings of a run.

Imports the errors alone. Nothing here knows an FMU; problems are collected with file and line.
"""
