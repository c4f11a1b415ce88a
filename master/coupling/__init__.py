"""Network, coupling schemes, the loop over macro steps, and the observers that belong to the loop.

Imports system, ssp and safety; whatever keeps to the protocol of a slave can be coupled, an FMU or a fake.
"""
