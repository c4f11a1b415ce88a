"""Figures of a mechanism about where it stands: equilibrium, linear motion, and what a test rig would measure.

The room may import the mechanism's equations, their assembly and its energy.
"""
