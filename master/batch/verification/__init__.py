"""Verification: cases are written as data, run, and judged row by row against references."""
