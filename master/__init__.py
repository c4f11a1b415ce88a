"""The co-simulation master: runs SSP scenarios of FMUs and judges the contact quality.

It meets the physics only through ``.fmu`` files. The order of reading is the path of the data:
``ssp`` (files) -> ``system`` (what is coupled to what) -> ``instance`` and ``algorithm`` (execution)
-> ``simulation`` and ``recorder`` -> ``quality`` -> ``results`` and ``report``.
"""
