"""slave."""
