"""The files of a new project: a scenario of a line and its pantographs, written from their names and a speed.

The master knows no physics: what it has to know of a line or a pantograph is handed in, or read from an FMU. The room
may import `master.ssp`, `master.system`, `master.fmu` and the rest of `master.scenario`.
"""
