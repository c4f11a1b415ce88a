"""The line about one set of points: mesh, matrices and droppers, made once for these points and handed on."""

from __future__ import annotations

from dataclasses import dataclass

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.shape.dropper_set import DropperSet, dropper_set
from models.catenary.shape.line_matrices import LineAssembly, Matrices
from models.catenary.shape.line_mesh import CatenaryMesh


@dataclass(frozen=True)
class LineShape:
    """A line about reference points.

    Attributes
    ----------
    definition : CatenaryDefinition
    mesh : CatenaryMesh
    points : ndarray, shape (n, 3)
        Reference positions [m].
    droppers : DropperSet
        Hung between these points.
    matrices : Matrices
        About these points.
    """

    definition: CatenaryDefinition
    mesh: CatenaryMesh
    points: FloatArray
    droppers: DropperSet
    matrices: Matrices


def line_shape(definition: CatenaryDefinition, mesh: CatenaryMesh, points: FloatArray) -> LineShape:
    """Assemble a line about reference points, shape (n, 3) [m]."""
    return shape_about(LineAssembly(definition, mesh), points)


def shape_about(assembly: LineAssembly, points: FloatArray, *, damped: bool = True) -> LineShape:
    """Assemble a line about reference points, shape (n, 3) [m], without its damping unless ``damped``."""
    definition, mesh = assembly.definition, assembly.mesh
    droppers = dropper_set(definition, mesh, points)
    matrices = assembly.matrices(points, droppers.mass, damped=damped)
    return LineShape(definition, mesh, points, droppers, matrices)
