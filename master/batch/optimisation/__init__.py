"""Optimisation: the values of a few parameters for which a figure of a scenario is least or greatest.

The order of the data: ``optimisation_goal`` (figure, bounds, constraints) -> ``candidate_search`` (which points to try,
by SciPy) -> ``optimisation_session`` (tries them with the runs, the engines, the journal and the table of a sweep) ->
``optimisation_page``. It may import what `batch` may, and ``sweep`` beside it.
"""
