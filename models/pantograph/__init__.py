"""Pantographs: what all have (`operation`), and the two kinds of model, lumped masses and mechanisms of rigid bodies.

The room may import arrays, definition files, numerics and the contact law; it knows no line.
"""
