"""What the package hands out to Python: a scenario to open and change, its run, results as data frames.

The names of `master` are found here. May import every room but the commands.
"""
