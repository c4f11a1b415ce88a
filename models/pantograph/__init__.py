"""Pantograph models: lumped masses and multibody."""
