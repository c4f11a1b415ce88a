"""Finite-element model of an overhead contact line."""
