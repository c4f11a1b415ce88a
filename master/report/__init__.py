"""What people look at: reports in HTML, charts as files, films, and tables for the terminal.

It imports what a run left (`master.results`, `master.recording`) and what is made of it (`master.evaluation`), and
knows neither how runs are made nor the commands that ask for a report.
"""
