"""Charts: each described once, as curves, bars and marks over axes with units, then drawn for a page or for a file.

It may import what `report` may, and nothing of its pages.
"""
