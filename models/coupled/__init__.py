"""A line and its pantographs without FMI: as one system, and many runs of one line side by side.

``monolithic`` is the reference that a co-simulation is compared with. ``lanes`` makes the runs of a sweep as a
co-simulation would, ``lane_block`` several at a time in the compiled kernels of ``lanes_*_kernels``, for which
``lane_matrices`` lays out the line. The room may import the catenary and the pantographs. It is longer than a room
should be for the kernels, which repeat in compiled form what other rooms say to be read.
"""
