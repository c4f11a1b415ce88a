"""One step of a line: the protocol of a step engine, and two engines side by side.

`numpy_engine` is there to be read, `numba_engine` with `step_kernels` to be fast; neither knows the other, both rest on
the same `StepMatrices`, and `engine_choice` chooses once for every step size.

May import `shape`, `linear_motion` and `contact_and_slack`.
"""
