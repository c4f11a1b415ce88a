"""Lines as others write them down: tables as CSV and XLSX, drawings as DXF; read, written, compared with measurements.

Imports the definition files, the catenary and the library; never part of an FMU. `openpyxl` and `ezdxf` are extras.
Larger than other rooms, as reading a table with every problem told and making a line of it are one way through.
"""
