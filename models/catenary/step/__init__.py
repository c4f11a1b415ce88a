"""One step of a line: the protocol of a step engine, and two engines side by side.

`plain_step` with `linear_step` is there to be read, `compiled_line_step` to be fast; neither knows the other, both rest
on the same `StepMatrices`, and `engine_choice` chooses once for every step size. The compiled one is one call::

    step_kernels        the step, part by part
    attachment_kernels  forces on the attachments and their solution, in eight segments: `attachment_lanes`
    mode_kernels        the modes follow, and prepare the next step: `mode_units`
    contact_kernels     strips that cross wires: `step_records` keeps what is read of intervals and droppers
    law_kernels         the law of a contact, small dense systems; of lanes, too
    local_kernels       contacts and slack droppers
    vector_kernels      eight numbers at once

That is twice the same step, once in the language of the physics and once in that of the machine, which is why the room
is large. What the kernels do is proved by the plain step, figure for figure.

May import `shape`, `linear_motion`, `contact_and_slack` and `line_state`.
"""
