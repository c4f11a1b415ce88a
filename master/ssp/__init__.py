"""SSP 1.0 files as they are written: archives, structures, parameter sets and mappings, units, the settings of a run.

Imports the errors and safety. Nothing here knows an FMU; problems are collected with file and line. The room is larger
than others because every kind of SSP document has its file, and every node its function.
"""
