"""From a definition and the sources to one archive."""
