"""Pure functions of a recording: filter, interval, figures, limits; imports nothing above recordings.

``filters``, ``contact_quality`` and ``en50367_limits`` need numpy alone, so that the physics' own command ``couple``
uses them too.
"""
