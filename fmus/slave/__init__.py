"""What travels inside an FMU: a part as a co-simulation slave; imports models and pythonfmu alone."""
