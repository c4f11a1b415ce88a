"""Pure functions of a recording: filter, interval, figures, limits.

``filters``, ``contact_quality`` and ``en50367_limits`` need numpy alone, so that the physics' own command ``couple``
uses them too; the rest of the room may also import ``master``'s errors, arrays, system and recording.
"""
