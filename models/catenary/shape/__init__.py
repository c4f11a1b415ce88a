"""The line as designed, at rest: mesh, matrices and droppers about a set of points, and the points found for them.

The static state keeps the `LineShape` that it was found with; rooms above take mesh, matrices and droppers from there
and assemble nothing.

A little larger than a room should be: the design and a changed line come to rest by one iteration.

May import `definition`, arrays and numerics.
"""
