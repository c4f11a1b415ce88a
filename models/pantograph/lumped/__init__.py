"""Pantographs as masses one above the other, on springs and dampers: definition, equations, energy, figures of a rig.

The room may import what every pantograph has; `lumped_part` is what a co-simulation steps.
It is larger than others because what is stepped can be read and compiled, law by law.
"""
