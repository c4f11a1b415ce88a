"""A pantograph's motion in as few coordinates as it has: a closed arm in one, its head in those of its own.

The room may import whatever describes and analyses a mechanism; the general form in Cartesian coordinates is its
reference. `reduced_equations` imports nothing of the project: kernels are compiled from the same lines.
"""
