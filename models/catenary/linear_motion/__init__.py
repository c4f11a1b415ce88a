"""linear_motion."""
