"""What a run leaves on disk as it goes: recordings, the static geometry, checkpoints; and continuing from one.

Imports coupling, system and safety.
"""
