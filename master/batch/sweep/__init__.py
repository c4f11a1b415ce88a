"""Sweeps: up to thousands of runs of one scenario with other values, here or on a cluster, with one table of figures.

The order of the data: ``swept_parameter`` (what is varied, in which unit) -> ``distributions``, ``sensitivity``
-> ``sweep_plan`` (the values of all runs) -> ``swept_systems`` (the checked runs) -> ``sweep_run`` (one of them) ->
``sweep_engines`` and ``dask_engine`` (all of them) -> ``sweep_journal`` (what is finished) -> ``sweep_table``,
``sensitivity_table`` -> ``pages`` (what the table says) -> ``sweep_session``. Beside them stands the engine that steps
runs side by side without FMUs: ``lane_system`` (what it can do) -> ``lanes_engine`` -> ``lane_evaluation`` (figures).
It may import what `batch` may: the rooms below it, and `batch_session`, `assessment_figures` and `calibration` beside
it.

It is longer than a room should be: the half up to ``swept_systems`` says which runs there are, the other makes them,
and neither is of use without the other.
"""
