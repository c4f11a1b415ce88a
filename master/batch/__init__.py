"""Many runs: calibration of a value, verification against references, and studies of a family of variants.

It may import everything in the master but `commands`; verification, study and calibration share `batch_session` and
know nothing of each other.
"""
