"""The page of a sweep: what its table says about the parameters, in curves, maps, bands, shares and rankings.

The order of the data: ``sweep_view`` (the table and what is known of it, from a sweep or its folder) ->
``sample_statistics`` and ``force_bands`` (what is computed from it) -> one file of charts for each kind of sweep ->
``sweep_page``. It reads the table and the series that were kept, and runs nothing.

It is somewhat longer than a room should be: each kind of sweep has charts of its own, and all share one view.
"""
