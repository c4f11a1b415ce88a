"""The checked, frozen description of what is coupled: components, connections, contacts, names of variables.

Imports ssp and what lies below it.
"""
