"""Many runs: calibration of a value, verification against references, and studies of a family of variants.

It imports everything of the master but its commands.
"""
