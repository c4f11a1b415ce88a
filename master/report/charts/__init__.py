"""Charts: each described once, as curves, bars and marks over axes with units, then drawn for a page or for a file.

It imports results and their evaluation, and nothing of the pages.
"""
