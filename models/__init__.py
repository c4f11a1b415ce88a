"""Physics of overhead contact lines and pantographs; knows nothing of FMI, SSP or XML."""
