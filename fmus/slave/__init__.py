"""What travels inside an FMU: a part as a co-simulation slave; imports models and pythonfmu alone.

Of its 1500 lines half are the adapter with the values, states and failures that it owns; the rest is what kinds of parts add.
"""
