"""One results folder: claimed, written, read back, compared, exported.

Imports the rooms below it, from ``ssp`` to ``evaluation``; knows neither reports nor how a run is made.
"""
