"""Pure functions of a recording: filter, interval, figures, limits, events; imports ``recording`` and what is below it.

``filters``, ``contact_quality`` and ``en50367_limits`` need numpy alone, because the ``couple`` command of the physics
uses them too. The room is larger than others because it is flat: each file answers one question about a recording.
"""
