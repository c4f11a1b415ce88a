"""From a definition and the sources to one archive, the FMU; imports slave, loader and models."""
