"""Verification: cases are written as data, run, and judged row by row against references.

It may import what `batch` may: the rooms below it, and `batch_session` beside it. `cases` holds those of the library.
"""
