"""Numerical tools that know no line and no pantograph: time integration, extrapolation, energy ledger, compiled code.

May import arrays alone.
"""
