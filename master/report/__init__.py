"""What people look at: reports in HTML, charts as files, films, and tables for the terminal.

It may import what a run left behind (`results`, `recording`), what is computed from it (`evaluation`) and all below
these; it knows neither how runs are made nor the commands that ask for a report.
The room is larger than others (1700 lines) as it holds every way of showing a run; its files hardly know one another.
"""
