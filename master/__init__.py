"""The co-simulation master: runs SSP scenarios of FMUs and judges the quality of the contact.

It meets the physics only through ``.fmu`` files. Its rooms follow the path of the data: ``ssp`` (files as written) ->
``system`` (what is coupled to what) -> ``fmu`` and ``coupling`` (execution) -> ``scenario`` and ``recording`` ->
``evaluation`` -> ``results`` -> ``run_session`` and ``report`` -> ``batch`` (many runs) -> ``interface`` (from Python)
-> ``commands``. ``errors``, ``arrays`` and ``safety`` lie below them all.

The names in ``__all__`` are kept from version to version (docs/python.md). They are imported when they are asked for,
not before: every isolated FMU's process imports this file.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from master.errors import MasterError
    from master.interface.optimisations import Optimisation, optimise
    from master.interface.parameter_sweeps import Sweep, sweep
    from master.interface.results_view import Results, compare, contact_figures, read_results
    from master.interface.scenario_runs import Calibrated, calibrate, run
    from master.interface.scenario_view import Parameter, Scenario, open_scenario

__all__ = [
    "Calibrated",
    "MasterError",
    "Optimisation",
    "Parameter",
    "Results",
    "Scenario",
    "Sweep",
    "calibrate",
    "compare",
    "contact_figures",
    "open_scenario",
    "optimise",
    "read_results",
    "run",
    "sweep",
]

if not TYPE_CHECKING:  # a type checker shall notice a name that is not there
    _PLACES = {
        "errors": ("MasterError",),
        "interface.optimisations": ("Optimisation", "optimise"),
        "interface.parameter_sweeps": ("Sweep", "sweep"),
        "interface.results_view": ("Results", "compare", "contact_figures", "read_results"),
        "interface.scenario_runs": ("Calibrated", "calibrate", "run"),
        "interface.scenario_view": ("Parameter", "Scenario", "open_scenario"),
    }

    def __getattr__(name: str) -> object:
        for place, names in _PLACES.items():
            if name in names:
                from importlib import import_module

                return getattr(import_module(f"{__name__}.{place}"), name)
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
