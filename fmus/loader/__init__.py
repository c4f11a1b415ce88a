"""Between a host and Python: the library that hosts load, and how it is made; imports nothing of the slaves."""
