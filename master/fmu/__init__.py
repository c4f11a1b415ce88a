"""All about one FMU; imports nothing above the system's description."""
