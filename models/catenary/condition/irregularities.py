"""Errors of assembly: normal, seeded, the same bits everywhere.

They are drawn for the designed line's droppers and supports, whatever has become of these.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from models.arrays import FloatArray, IntArray
from models.catenary.definition.condition_definition import Irregularity
from models.catenary.shape.line_mesh import CatenaryMesh
from models.numerics.random_numbers import normal_numbers

#: Errors beyond this many standard deviations are set to it: nobody would have left them.
_LIMIT: Final = 3.0
#: Streams of random numbers, one for a kind of error. Never renumber them: results of earlier studies would change.
_DROPPER_LENGTH, _DROPPER_POSITION, _SUPPORT_HEIGHT, _STAGGER = 1, 2, 3, 4


def dropper_length_errors(irregularity: Irregularity, mesh: CatenaryMesh) -> FloatArray:
    """Return what every dropper and hanger is too long [m], shape (n_droppers,), in the order of the mesh."""
    sigma = irregularity.dropper_length_sigma
    return sigma * _in_order(mesh, mesh.droppers[:, 0], irregularity.seed, _DROPPER_LENGTH)


def dropper_position_errors(irregularity: Irregularity, mesh: CatenaryMesh) -> FloatArray:
    """Return by how much every dropper and hanger hangs too far along the track [m], shape (n_droppers,)."""
    sigma = irregularity.dropper_position_sigma
    return sigma * _in_order(mesh, mesh.droppers[:, 0], irregularity.seed, _DROPPER_POSITION)


def support_height_errors(irregularity: Irregularity, mesh: CatenaryMesh) -> FloatArray:
    """Return what every support between the anchors stands too high [m], shape (n_supports,)."""
    sigma = irregularity.support_height_sigma
    return sigma * _in_order(mesh, mesh.support_nodes, irregularity.seed, _SUPPORT_HEIGHT)


def stagger_errors(irregularity: Irregularity, mesh: CatenaryMesh) -> FloatArray:
    """Return by how much a registration end is too far to the left at every support [m], shape (n_supports,).

    Those without a steady arm have a number, too, so that one arm's does not depend on which others there are.
    """
    sigma = irregularity.stagger_sigma
    return sigma * _in_order(mesh, mesh.support_nodes, irregularity.seed, _STAGGER)


def _in_order(mesh: CatenaryMesh, nodes: IntArray, seed: int, stream: int) -> FloatArray:
    """Return limited normal numbers for things at some nodes, drawn in the order of section and place."""
    order = np.lexsort((mesh.points[nodes, 0], mesh.section[nodes]))
    result = np.empty(len(nodes))
    result[order] = np.clip(normal_numbers(seed, stream, len(nodes)), -_LIMIT, _LIMIT)
    return result
