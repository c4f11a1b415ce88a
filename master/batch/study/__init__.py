"""Families of runs: one scenario, many variants, reported side by side."""
