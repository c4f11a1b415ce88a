"""What is not linear in a step: strips that press on wires, and droppers that go slack.

One word for each thing around a contact::

    strip  A ---------------o------- B    Crossing          where o lies in plan: element and share xi of the wire,
                                                            share of the strip
    wire   ---x---+---+-----o--+---x---   WirePoint         o on the wire: its interval, its row in the coordinates,
                                                            static height, compliance
              x attachments, + nodes      IntervalResponse  how the piece x...x gives way to a force within a step
                                          ContactCandidate  a strip over a WirePoint before any force: penetration,
                                                            velocity
                                          AppliedForce      a WirePoint and a force that is known before the step

A `ContactWire` and its intervals are places, not contacts. The local problem answers with `LocalForces`.

May import the rooms below it (`definition`, `shape`, `linear_motion`) and the contact law.
"""
