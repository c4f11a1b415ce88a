"""All about one FMU: built or found, described, extracted, loaded, also in a process for itself (isolation).

Imports system, ssp and safety; knows nothing of the coupling.
"""
