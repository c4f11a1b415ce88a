"""Finite-element model of an overhead contact line, in the order of the data.

`definition` (what it is) -> `shape` (at rest) -> `linear_motion` (about that shape) -> `contact_and_slack` (what is not
linear) -> `step` -> `line_model`, which puts them together; `statics`, `line_energy` and the checks ask the model, and
`line_part` is the line between communication points.

May import arrays, definition files, numerics and the contact law; it knows no pantograph.
"""
