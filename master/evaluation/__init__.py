"""Pure functions of a recording."""
