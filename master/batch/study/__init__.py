"""Studies: a family of variants of one scenario, run one after the other and reported side by side.

It may import what `batch` may: the rooms below it, and `batch_session` and `calibration` beside it.
"""
