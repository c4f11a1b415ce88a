"""Between a host and Python: the library that hosts load, and the Python that an FMU may bring; imports no slave.

Twice as long as a room should be: half of it is the loader in C, which has to be one library, and its counterparts for
Linux and Windows; the other half (runtime and all that it imports) serves standalone FMUs alone.
"""
