"""FMI 2.0 co-simulation units of the models: thin adapters on pythonfmu, and their build."""
