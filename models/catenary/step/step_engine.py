"""What a step engine is given."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from models.catenary.contact_and_slack.contact_wire import WireInterval
from models.catenary.contact_and_slack.wire_response import Reaction

#: How a wire gives way about an interval.
ReactionOf = Callable[[WireInterval], Reaction]


class Known(NamedTuple):
    """A force on a contact wire that is known before a step.

    Attributes
    ----------
    reaction : Reaction
        Of the interval that it acts on.
    element : int
        Of the interval.
    xi : float
        Share of the way along the element.
    force : float
        Positive up [N].
    """

    reaction: Reaction
    element: int
    xi: float
    force: float
