"""Pure functions of a recording; imports nothing above recordings."""
