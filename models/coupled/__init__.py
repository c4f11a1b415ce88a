"""A line and its pantographs as one system, without FMI: the reference that a co-simulation is compared with.

The room may import the catenary and the pantographs.
"""
