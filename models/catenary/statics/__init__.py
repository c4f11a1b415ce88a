"""Figures of the line at rest: shapes of the wires, droppers, steady arms, elasticity, speed of waves in the wires.

May import the line model and all rooms below it.
"""
