"""The line's motion about its static shape, as far as it is linear.

Its coordinates (modes of intervals, displacements of attachments), their values, the matrices of one step size, how the
attachments are solved for, and what they give way by under local loads.

May import `definition` and `shape`.
"""
