"""A line of ours as an OpenSees model: same nodes, elements, tension, masses, damping and time integration.

What is taken over is the mesh and the static shape; element matrices, assembly, static solution and steps are
OpenSees' own. Its domain is global, so there is one such line at a time.

Wires are ``ModElasticBeam3d`` elements under ``PDelta``. PDelta knows the stiffness of a tensioned *chord* only,
F / l between the ends' transverse displacements. The consistent geometric stiffness of our beams, F K_G, is that chord
plus F l / 30 [[4, -1], [-1, 4]] on the two rotations against it, and the stiffness of these rotations is what
``ModElasticBeam3d`` lets one choose: so OpenSees can carry our very matrix. ``elasticBeamColumn``, which most OpenSees
models would use, lacks the second part; it is offered as ``Formulation.CHORD``. With six elements between droppers
LN2's elasticity is 1.5 % below that of a mesh four times as fine with the former, 1.8 % above with the latter.

The tension is not an input of OpenSees' elements: their nodes are moved along the track until the wires are strained as
they should be, and the equilibrium is found from there. What differs then from our line is small: the tension there
varies with the motion, a wire's slope changes by its strain (0.3 %), and stretched wires carry lateral loads on a
longer way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from pathlib import Path

import numpy as np
import openseespy.opensees as ops

from models.arrays import FloatArray, IntArray
from models.catenary.definition.line_definition import COMPONENTS, SHEAR_RATIO
from models.catenary.line_model import CatenaryModel
from models.catenary.shape.beam_elements import NODE_DOFS, frames, hermite_rows
from models.catenary.shape.line_matrices import beam_properties

#: Tags: one load pattern holds the weight, one a static force, those from the third on a moving force's histories.
_WEIGHT, _POINT, _MOVING = 1, 2, 3
_TRANSFORMATION_WIRE, _TRANSFORMATION_ARM = 1, 2
_REGION_BEAMS, _REGION_DROPPERS = 1, 2
#: Iterations end when the norm of the increments [m, rad] or of the unbalanced forces [N, N m] is below this.
TOLERANCES = {"NormDispIncr": 1e-8, "NormUnbalance": 1e-3}
_ITERATIONS = 100


class Formulation(Enum):
    """Geometric stiffness of the wires."""

    CONSISTENT = "consistent"
    CHORD = "chord"


@dataclass(frozen=True)
class Solver:
    """How OpenSees solves a step.

    Attributes
    ----------
    algorithm : str
        With its options, divided by spaces.
    system, numberer : str
    damping : str
        "current" or "committed": the stiffness that the damping of the beams is proportional to. They are the same
        up to the variation of the tension, but one of them is cheaper.
    test : str
        What ends the iterations, a key of ``TOLERANCES``. Unbalanced forces tell it one solution earlier.
    """

    algorithm: str
    system: str
    numberer: str
    damping: str = "current"
    test: str = "NormUnbalance"


@dataclass(frozen=True)
class Point:
    """A place on the contact wire as nodes and their shape functions.

    Attributes
    ----------
    nodes : tuple of int
        The element's two nodes.
    shape : ndarray, shape (2, 6)
        Height of the wire there per displacement of each of them; also the nodal forces of a unit vertical force.
    """

    nodes: tuple[int, int]
    shape: FloatArray


class WirePoints:
    """Finds places on a section's contact wire, from the static shape of the mesh alone."""

    def __init__(self, model: CatenaryModel, section: int = 0) -> None:
        self._nodes = model.mesh.contact_chains()[section].nodes
        self._x = model.static.positions[self._nodes, 0]
        points = model.static.shape.points[self._nodes]
        self._axes, self._length = frames(points[:-1], points[1:])

    def at(self, x: float) -> Point:
        """Return the place at a position along the track [m]."""
        k = min(max(int(np.searchsorted(self._x, x, side="right")) - 1, 0), len(self._length) - 1)
        xi = (x - self._x[k]) / (self._x[k + 1] - self._x[k])
        shape = np.array([1.0, xi, xi**2, xi**3]) @ hermite_rows(self._axes[[k]], self._length[[k]])[0]
        return Point((int(self._nodes[k]), int(self._nodes[k + 1])), shape.reshape(2, NODE_DOFS))


class OpenSeesLine:
    """The line in OpenSees, in its static equilibrium under weight and tension.

    Parameters
    ----------
    model : CatenaryModel
        Whose mesh, static shape and dropper lengths are taken over.
    formulation : Formulation

    Raises
    ------
    NotImplementedError
        If the line has what is not translated.
    RuntimeError
        If OpenSees does not find the equilibrium.
    """

    def __init__(self, model: CatenaryModel, formulation: Formulation) -> None:
        self.model, self.formulation = model, formulation
        self.points = WirePoints(model)
        _check(model)
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", NODE_DOFS)
        self._nodes()
        self._beams()
        self._droppers()
        self._stretch()
        self._weight()
        self._settle()
        self.rest = self.heights(model.mesh.support_nodes)

    def _nodes(self) -> None:
        mesh = self.model.mesh
        for node, (point, fixed, mass) in enumerate(
            zip(self.model.static.shape.points.tolist(), mesh.fixed.tolist(), mesh.clamp_mass.tolist(), strict=True)
        ):
            ops.node(node, *point)
            if any(fixed):
                ops.fix(node, *map(int, fixed))
            if mass > 0.0:
                ops.mass(node, mass, mass, mass, 0.0, 0.0, 0.0)

    def _beams(self) -> None:
        """Create wires and steady arms; both are held back across their axes by their tension, if ours are."""
        mesh, definition = self.model.mesh, self.model.definition
        properties = beam_properties(definition, mesh)
        _, length = self._frames()
        ops.geomTransf("PDelta", _TRANSFORMATION_WIRE, 0.0, 0.0, 1.0)
        swing = definition.dynamics.geometric_stiffness
        ops.geomTransf("PDelta" if swing else "Linear", _TRANSFORMATION_ARM, 0.0, 0.0, 1.0)
        for k, (i, j) in enumerate(mesh.beams.tolist()):
            tension, EI = float(properties.tension[k]), float(properties.EI[k])
            E = getattr(definition, COMPONENTS[mesh.component[k]]).youngs_modulus
            G = E / SHEAR_RATIO
            section = (float(properties.EA[k]) / E, E, G, float(properties.GJ[k]) / G, EI / E, EI / E)
            transformation = _TRANSFORMATION_WIRE if tension > 0.0 else _TRANSFORMATION_ARM
            mass = ("-mass", float(properties.mass[k]), "-cMass")
            if tension > 0.0 and self.formulation is Formulation.CONSISTENT:
                bow = tension * float(length[k]) ** 2 / (30.0 * EI)
                rotations = (4.0 + 4.0 * bow, 4.0 + 4.0 * bow, 2.0 - bow)
                ops.element("ModElasticBeam3d", k, i, j, *section, *rotations, *rotations, transformation, *mass)
            else:
                ops.element("elasticBeamColumn", k, i, j, *section, transformation, *mass)

    def _droppers(self) -> None:
        """Create the droppers: trusses strained at rest by their static force, with consistent mass.

        Where ours are held back across their axes, springs N/L do it, in x and y: droppers hang nearly upright.
        Corotational trusses would too, but do not find the equilibrium from wires that are only being stretched.
        """
        mesh, static, definition = self.model.mesh, self.model.static, self.model.definition
        stiffness, ratio = static.droppers.stiffness, static.droppers.compression_ratio
        per_length = np.where(mesh.is_hanger, getattr(definition.hanger, "mass", 0.0), definition.dropper.mass)
        for j, (lower, upper) in enumerate(mesh.droppers.tolist()):
            length = math.dist(static.shape.points[lower], static.shape.points[upper])
            EA = float(stiffness[j]) * length
            tag = 2 * j + 1
            ops.uniaxialMaterial("Elastic", tag, EA, 0.0, float(ratio[j]) * EA)
            ops.uniaxialMaterial("InitStrainMaterial", tag + 1, tag, float(static.elastic_force[j]) / EA)
            mass = ("-rho", float(per_length[j]), "-cMass", 1, "-doRayleigh", 1)
            ops.element("Truss", len(mesh.beams) + j, lower, upper, 1.0, tag + 1, *mass)

        if definition.dynamics.geometric_stiffness:
            self._swing(2 * len(mesh.droppers) + 1, len(mesh.beams) + len(mesh.droppers))

    def _swing(self, material: int, element: int) -> None:
        """Hold droppers back across their axes; the first tags of materials and elements that are free are given."""
        mesh, static = self.model.mesh, self.model.static
        for j, (lower, upper) in enumerate(mesh.droppers.tolist()):
            ops.uniaxialMaterial("Elastic", material + j, max(static.dropper_force[j], 0.0) / static.droppers.length[j])
            materials = (material + j, material + j)
            ops.element("zeroLength", element + j, lower, upper, "-mat", *materials, "-dir", 1, 2)

    def _stretch(self) -> None:
        """Stretch the wires by their tension: their nodes move along the track, and with them the arms' far ends."""
        mesh = self.model.mesh
        properties = beam_properties(self.model.definition, mesh)
        axes, length = self._frames()
        wires = properties.tension > 0.0
        longer = (properties.tension / properties.EA * length)[wires] / axes[wires, 0, 0]
        along = dict(zip(map(tuple, mesh.beams[wires].tolist()), longer.tolist(), strict=True))
        moved: dict[int, float] = {}
        for chain in mesh.chains:
            nodes = chain.nodes.tolist()
            moved.setdefault(nodes[0], 0.0)
            for i, j in pairwise(nodes):
                moved[j] = moved[i] + along[i, j]
        moved |= {end: moved[node] for end, node in mesh.arms.tolist()}
        for node, value in moved.items():
            ops.setNodeDisp(node, 1, value, "-commit")
        self._moved = moved

    def _weight(self) -> None:
        """Apply our static load but for the tension, which here is inside the elements."""
        axes, _ = self._frames()
        mesh, load = self.model.mesh, self.model.static.shape.matrices.load.reshape(-1, NODE_DOFS).copy()
        pull = beam_properties(self.model.definition, mesh).tension[:, None] * axes[:, 0]
        np.add.at(load[:, :3], mesh.beams[:, 0], -pull)
        np.add.at(load[:, :3], mesh.beams[:, 1], pull)
        ops.timeSeries("Constant", _WEIGHT)
        ops.pattern("Plain", _WEIGHT, _WEIGHT)
        if self.model.definition.dynamics.geometric_stiffness:
            self._upright(load)
        for node, values in enumerate(load.tolist()):
            ops.load(node, *values)

    def _upright(self, load: FloatArray) -> None:
        """Let droppers hang upright between the stretched wires: the springs across them count from there."""
        mesh, static = self.model.mesh, self.model.static
        for j, (lower, upper) in enumerate(mesh.droppers.tolist()):
            pull = static.dropper_force[j] / static.droppers.length[j] * (self._moved[upper] - self._moved[lower])
            load[lower, 0] -= pull
            load[upper, 0] += pull

    def _settle(self) -> None:
        """Find the equilibrium, from which time begins."""
        ops.constraints("Plain")
        ops.numberer("RCM")
        ops.system("UmfPack")
        ops.test("NormDispIncr", TOLERANCES["NormDispIncr"], _ITERATIONS)
        ops.algorithm("Newton")
        ops.integrator("LoadControl", 0.0)
        ops.analysis("Static", "-noWarnings")
        self._equilibrate()
        ops.loadConst("-time", 0.0)

    @staticmethod
    def _equilibrate() -> None:
        if ops.analyze(1) != 0:
            raise RuntimeError("OpenSees has not found the static equilibrium")

    def _frames(self) -> tuple[FloatArray, FloatArray]:
        start, end = self.model.mesh.beams.T
        points = self.model.static.shape.points
        return frames(points[start], points[end])

    def heights(self, nodes: IntArray) -> FloatArray:
        """Return the vertical displacements of nodes [m]."""
        return np.array([ops.nodeDisp(int(node), 3) for node in nodes])

    def dropper_force(self) -> FloatArray:
        """Return the droppers' tension [N], shape (n_droppers,)."""
        first, count = len(self.model.mesh.beams), len(self.model.mesh.droppers)
        return np.array([ops.eleResponse(first + j, "axialForce")[0] for j in range(count)])

    def height_at(self, point: Point) -> float:
        """Return the vertical displacement of the wire at a place [m]."""
        displacement = [[ops.nodeDisp(node, dof) for dof in range(1, NODE_DOFS + 1)] for node in point.nodes]
        return float((point.shape * np.array(displacement)).sum())

    def elasticity(self, x: FloatArray, force: float) -> FloatArray:
        """Return the static uplift per vertical force at positions along the track [m/N]."""
        places = [self.points.at(float(at)) for at in x]
        before = [self.height_at(p) for p in places]
        uplift = [self._pushed(place, force) for place in places]
        self._equilibrate()
        return (np.array(uplift) - before) / force

    def _pushed(self, place: Point, force: float) -> float:
        ops.pattern("Plain", _POINT, _WEIGHT)
        for node, shape in zip(place.nodes, place.shape, strict=True):
            ops.load(node, *(force * shape).tolist())
        self._equilibrate()
        result = self.height_at(place)
        ops.remove("loadPattern", _POINT)
        return result

    def move(self, path: FloatArray, force: float, step: float) -> None:
        """Let a constant vertical force run along the wire.

        OpenSees evaluates the histories of the nodes' loads itself: nothing of Python remains within the steps.

        Parameters
        ----------
        path : ndarray, shape (n,)
            Where the force is at the end of each step [m].
        force : float
            [N].
        step : float
            [s].
        """
        for tag, (node, dof, first, values) in enumerate(self._histories(path, force), _MOVING):
            # A value before and after, from which the force rises and to which it falls: 0.
            ops.timeSeries("Path", tag, "-dt", step, "-values", 0.0, *values, 0.0, "-startTime", first * step)
            ops.pattern("Plain", tag, tag)
            ops.load(node, *(1.0 if k == dof else 0.0 for k in range(NODE_DOFS)))

    def _histories(self, path: FloatArray, force: float) -> Iterator[tuple[int, int, int, list[float]]]:
        """Yield node, degree of freedom, last step before the load and the load at each step from there on."""
        loads: dict[tuple[int, int], dict[int, float]] = {}
        for n, x in enumerate(path.tolist()):
            point = self.points.at(x)
            for node, shape in zip(point.nodes, point.shape, strict=True):
                for dof in np.flatnonzero(shape):
                    loads.setdefault((node, int(dof)), {})[n] = force * float(shape[dof])
        for (node, dof), history in loads.items():
            steps = range(min(history), max(history) + 1)
            yield node, dof, min(history), [history.get(n, 0.0) for n in steps]

    def prepare(self, solver: Solver) -> None:
        """Set up steps by the trapezoidal rule, with damping proportional to stiffness."""
        self._damp(solver.damping)
        ops.wipeAnalysis()
        ops.constraints("Plain")
        ops.numberer(solver.numberer)
        ops.system(solver.system)
        ops.test(solver.test, TOLERANCES[solver.test], _ITERATIONS)
        ops.algorithm(*solver.algorithm.split())
        ops.integrator("Newmark", 0.5, 0.25)
        ops.analysis("Transient", "-noWarnings")

    def _damp(self, stiffness: str) -> None:
        """Damp each component; a dropper that is slack goes on damping, as in our model by the law "elastic_only"."""
        mesh, damping = self.model.mesh, self.model.definition.damping
        rayleigh = beam_properties(self.model.definition, mesh)
        alpha, beta = float(rayleigh.alpha[0]), float(rayleigh.beta[0])
        place = (alpha, 0.0, 0.0) if stiffness == "current" else (0.0, 0.0, alpha)
        ops.region(_REGION_BEAMS, "-eleRange", 0, len(mesh.beams) - 1, "-rayleigh", beta, *place)
        last = len(mesh.beams) + len(mesh.droppers) - 1
        dropper = damping.of("dropper")
        ops.region(
            _REGION_DROPPERS, "-eleRange", len(mesh.beams), last, "-rayleigh", dropper.beta, 0.0, dropper.alpha, 0.0
        )

    def record(self, nodes: IntArray, heights: Path, forces: Path) -> None:
        """Let OpenSees write every step: time, vertical displacements of nodes or tensions of the droppers."""
        common = ("-precision", 12, "-time")
        ops.recorder("Node", "-file", str(heights), *common, "-node", *nodes.tolist(), "-dof", 3, "disp")
        first, count = len(self.model.mesh.beams), len(self.model.mesh.droppers)
        ops.recorder("Element", "-file", str(forces), *common, "-ele", *range(first, first + count), "axialForce")

    @staticmethod
    def steps(count: int, step: float) -> None:
        """Advance by some steps.

        Raises
        ------
        RuntimeError
            If a step is not solved.
        """
        if ops.analyze(count, step) != 0:
            raise RuntimeError("OpenSees has not solved a step")

    @staticmethod
    def close() -> None:
        """Let go of the line, and have the recorders write what they still hold."""
        ops.wipe()


def _check(model: CatenaryModel) -> None:
    """Refuse lines that would not be the same in OpenSees."""
    definition, beams = model.definition, beam_properties(model.definition, model.mesh)
    if definition.stitch_wire is not None or definition.messenger_support is not None:
        raise NotImplementedError("lines with stitch wires or elastic supports are not translated for OpenSees")
    if np.ptp(beams.alpha) > 0.0 or np.ptp(beams.beta) > 0.0:
        raise NotImplementedError("lines whose beams are damped differently are not translated for OpenSees")
    hung = [item for item in (definition.dropper, definition.hanger) if item is not None]
    if any(item.slack_law != "elastic_only" for item in hung) and definition.damping.of("dropper").alpha > 0.0:
        raise NotImplementedError('slack droppers keep their dampers in OpenSees: take slack_law = "elastic_only"')
