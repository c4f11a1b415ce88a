"""Physics of overhead contact lines and pantographs; knows nothing of FMI, SSP or XML.

The names in ``__all__`` are kept from version to version (docs/python.md). They are imported when they are asked for,
not before.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from models.definition_files.parameter import Parameter, ParameterError
    from models.definition_files.toml_reader import DefinitionError
    from models.interface.coupled_run import CoupledRun, couple
    from models.interface.line_and_pantograph import Line, Pantograph, open_line, open_pantograph
    from models.interface.line_as_built import LineAsBuilt, as_built
    from models.interface.line_in_wind import LineInWind, in_wind
    from models.interface.line_over_temperature import LineOverTemperature, over_temperature
    from models.interface.line_spans import SpanTable, span_table
    from models.interface.line_statics import LineStatics, statics
    from models.library.catalogue import UnknownNameError, line_names, pantograph_names

__all__ = [
    "CoupledRun",
    "DefinitionError",
    "Line",
    "LineAsBuilt",
    "LineInWind",
    "LineOverTemperature",
    "LineStatics",
    "Pantograph",
    "Parameter",
    "ParameterError",
    "SpanTable",
    "UnknownNameError",
    "as_built",
    "couple",
    "in_wind",
    "line_names",
    "open_line",
    "open_pantograph",
    "over_temperature",
    "pantograph_names",
    "span_table",
    "statics",
]

if not TYPE_CHECKING:  # a type checker shall notice a name that is not there
    _PLACES = {
        "definition_files.parameter": ("Parameter", "ParameterError"),
        "definition_files.toml_reader": ("DefinitionError",),
        "interface.coupled_run": ("CoupledRun", "couple"),
        "interface.line_and_pantograph": ("Line", "Pantograph", "open_line", "open_pantograph"),
        "interface.line_as_built": ("LineAsBuilt", "as_built"),
        "interface.line_in_wind": ("LineInWind", "in_wind"),
        "interface.line_over_temperature": ("LineOverTemperature", "over_temperature"),
        "interface.line_spans": ("SpanTable", "span_table"),
        "interface.line_statics": ("LineStatics", "statics"),
        "library.catalogue": ("UnknownNameError", "line_names", "pantograph_names"),
    }

    def __getattr__(name: str) -> object:
        for place, names in _PLACES.items():
            if name in names:
                from importlib import import_module

                return getattr(import_module(f"{__name__}.{place}"), name)
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
