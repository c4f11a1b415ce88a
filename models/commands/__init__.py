"""The command line of the physics, ``python -m models VERB``: one ``*_command`` a verb, put together by `physics_main`.

Of the other packages the room may import the master's filters and figures of a contact force alone, so that both judge
a run alike; it does not travel inside an FMU, and may use rich and matplotlib. It is larger than other rooms
for the tables and figures that each verb has.
"""
