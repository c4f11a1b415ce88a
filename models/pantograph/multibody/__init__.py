"""Pantographs as mechanisms: rigid bodies, joints between them, force elements, under a force on the strip.

From the definition (`mechanism_definition`, `mechanism_reading`) by the equations (`mechanism`), their assembly, energy
and integration to `multibody_part`, which a co-simulation steps. The room may import what every pantograph has.

The room is larger than others because a mechanism is declared, derived, assembled and stepped here, each in a file.
"""
