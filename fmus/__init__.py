"""FMI 2.0 around the models, without arithmetic: the slave in an FMU, its loader, its build; imports models."""
