"""Numerical tools that know no line and no pantograph."""
