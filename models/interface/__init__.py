"""What the package hands out to Python: lines and pantographs from definitions, statics, the pair as one system.

The names of `models` are found here. May import every room but the commands; nothing of it goes into an FMU. It has
more lines than a room should, as every object that is handed out says what its attributes, arguments and errors are.
"""
