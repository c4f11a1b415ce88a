"""All about one FMU: built or found, described, extracted, loaded, also in a separate process (isolation).

Imports system, ssp and safety; knows nothing of the coupling. Half of its lines are the room in it, isolation.
"""
