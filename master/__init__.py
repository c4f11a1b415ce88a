"""The co-simulation master: runs SSP scenarios of FMUs and judges the quality of the contact.

It meets the physics only through ``.fmu`` files. Its rooms follow the path of the data: ``ssp`` (files as written) ->
``system`` (what is coupled to what) -> ``fmu`` and ``coupling`` (execution) -> ``scenario`` and ``recording`` ->
``evaluation`` -> ``results`` -> ``run_session`` and ``report`` -> ``batch`` (many runs) -> ``commands``. ``errors``,
``arrays`` and ``safety`` lie below them all. Every isolated FMU's process imports this file, so it imports nothing.
"""
