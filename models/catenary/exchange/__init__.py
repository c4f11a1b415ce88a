"""What passes between strips and line at a communication point: strips continued within a step, resultants handed out.

`strip_exchange` has it twice, to be read and with `exchange_kernels` to be fast; `line_part` takes the second where the
line steps in compiled kernels.
"""
