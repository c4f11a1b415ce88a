"""lumped."""
