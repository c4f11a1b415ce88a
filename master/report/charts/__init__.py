"""Charts: each is described once, as curves, bars and marks over axes with units, and drawn by two renderers.

It may import what `report` may, and nothing of its pages.
"""
