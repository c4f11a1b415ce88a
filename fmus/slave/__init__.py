"""What travels inside an FMU: a part as a co-simulation slave; imports models and pythonfmu alone.

Half of its 1500 lines are the adapter with the values, states and failures that it owns, the rest what each kind of
part adds.
"""
