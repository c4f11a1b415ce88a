"""Signals from tables: read from a file, continued between its rows, told at communication points. No physics.

The room may import what reads definitions and what knows numbers alone; `signal_part` is what a co-simulation steps.
"""
