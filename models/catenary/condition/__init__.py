"""The line as found on the day: a second equilibrium of the designed line, with the lengths of its droppers given.

Errors of assembly and faults act here, after form finding; a line without any skips the room. The result is a static
state like that of form finding, and rooms above take it in its place.

May import `definition`, `shape` and numerics.
"""
