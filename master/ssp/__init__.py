"""Reading and writing System Structure and Parameterization (SSP 1.0) packages."""
