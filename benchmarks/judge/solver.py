"""Explicit finite elements for a robot in its rest frame: quadratic or linear tetrahedra, quadrature by scikit-fem.

Matter, muscles, viscosity, the ground's layer and friction are the equations of zoobench, discretised without its grid
and its particles. Masses are lumped in proportion to the consistent mass matrix's diagonal. A quadratic tetrahedron
feels the ground as eight linear ones, over which the layer's force is integrated exactly: all of its nodal forces point
upward, so that Coulomb's law can hold at nodes. Time steps are symplectic Euler, as zoobench's.
"""

import ctypes
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judge.meshes import Indices, Mesh
from zoobench.arrays import Array

LANES = 16
FRAME = 0.008
"""A control frame [s]."""

_REST_SPEED = 2.5e-7
"""Largest horizontal speed of a body at rest, between stops [m/s], as zoobench's."""

_COURANT = 0.7
_FASTEST_NODE = 3.0
"""Stiffness by mass of a node, at most, as a multiple of the median [-]."""
_VISCOUS = 0.7
"""Safety of the stages of viscosity within a frame, in which elements are compressed [-]."""

_SKIN_STEP = 0.35
"""Share of the layer that the fastest node may cross in a step [-]."""

_FLAGS = ("-O3", "-march=native", "-ffast-math", "-fno-finite-math-only", "-Wno-psabi", "-shared", "-fPIC")
_PIECES = (
    (0, 4, 6, 7),
    (4, 1, 5, 8),
    (6, 5, 2, 9),
    (7, 8, 9, 3),
    (4, 5, 6, 8),
    (4, 6, 7, 8),
    (6, 5, 9, 8),
    (6, 9, 7, 8),
)
"""A quadratic tetrahedron as eight linear ones; the octahedron in the middle is cut along the edge from 6 to 8."""


@dataclass(frozen=True)
class Matter:
    """Constants [SI]: as of `ElasticMaterial` and `GroundSkin`."""

    youngs_modulus: float
    poissons_ratio: float
    density: float
    viscosity: float
    gravity: float = 9.81
    friction: float = 0.5
    slope: float = 0.0
    thickness: float = 4e-3
    stiffness: float = 2e4

    @property
    def lame(self) -> tuple[float, float]:
        """(mu, lambda) [Pa]."""
        E, nu = self.youngs_modulus, self.poissons_ratio
        return E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


class _Body(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_int) for name in ("blocks", "node_count", "pieces", "stages")),
        *(
            (name, ctypes.c_void_p)
            for name in ("cells", "slopes", "inverse", "volume", "mu", "lam", "fibre", "tension", "pulled")
        ),
        *(
            (name, ctypes.c_void_p)
            for name in ("piece", "piece_volume", "mass", "weight", "x", "v", "force", "push", "stage", "way", "held")
        ),
        *((name, ctypes.c_double) for name in ("eta", "friction", "slope", "thickness", "rate")),
    )


@cache
def _library() -> ctypes.CDLL:
    """The kernels, compiled for this processor."""
    source, target = Path(__file__).with_name("elements.cpp"), Path(tempfile.mkdtemp()) / "elements.so"
    subprocess.run(["c++", *_FLAGS, "-o", str(target), str(source)], check=True)
    return ctypes.CDLL(str(target))


class Element:
    """Shape functions and quadrature of a tetrahedron with 4 or 10 nodes.

    Attributes:
        values, slopes: of the shape functions at the quadrature points, `[point, node]` and `[point, node, 3]`.
        weights: `[point]`; their sum is the reference element's volume.
        places: of the quadrature points, barycentric `[point, 4]`.
    """

    def __init__(self, nodes: int) -> None:
        from skfem import ElementTetP1, ElementTetP2
        from skfem.quadrature import get_quadrature
        from skfem.refdom import RefTet

        element = {4: ElementTetP1, 10: ElementTetP2}[nodes]()
        places, self.weights = get_quadrature(RefTet, {4: 1, 10: 2}[nodes])
        shapes = [element.lbasis(places, n) for n in range(nodes)]
        self.values = np.stack([value for value, _ in shapes], axis=1)
        self.slopes = np.stack([slope.T for _, slope in shapes], axis=1)
        self.places = np.vstack([1.0 - places.sum(axis=0), places]).T
        fine, fine_weights = get_quadrature(RefTet, 4)
        squares = np.array([(element.lbasis(fine, n)[0] ** 2 * fine_weights).sum() for n in range(nodes)])
        self.lumps = squares / squares.sum()
        self.shares = np.array([(element.lbasis(fine, n)[0] * fine_weights).sum() for n in range(nodes)]) * 6.0

    def at(self, places: Array) -> Array:
        """Shape functions at barycentric places `[..., 4]`: `[..., node]`."""
        if len(self.shares) == 4:
            return places
        from benchmarks.judge.meshes import EDGES

        corners = places * (2.0 * places - 1.0)
        middles = [4.0 * places[..., a] * places[..., b] for a, b in EDGES]
        return np.concatenate([corners, np.stack(middles, axis=-1)], axis=-1)


def sample_places(count: int) -> Array:
    """Evenly spread barycentric places in a tetrahedron, `count` along an edge."""
    grid = np.array([k for k in np.ndindex(count, count, count) if sum(k) < count], float)
    found: Array = (np.column_stack([count - 1.0 - grid.sum(axis=1), grid]) + 0.25) / count
    return found


class Solver:
    """A body of tetrahedra on level ground at y = 0.

    Args:
        mesh: at rest.
        matter: constants.
        stiffness, density: relative to the matter's, `[cell, point]` and `[cell]`.
        fibres: unit directions `[cell, point, 3]`.
        membership: share of each muscle `[cell, point, muscle]`.
    """

    def __init__(
        self,
        mesh: Mesh,
        matter: Matter,
        *,
        stiffness: Array | float = 1.0,
        density: Array | float = 1.0,
        fibres: Array | None = None,
        membership: Array | None = None,
    ) -> None:
        self.mesh, self.matter = mesh, matter
        self.nodes = mesh.cells.shape[1]
        self.element = element = Element(self.nodes)
        count, points = len(mesh.cells), len(element.weights)
        jacobian = np.einsum("eai,qac->eqic", mesh.points[mesh.cells], element.slopes)
        size = np.linalg.det(jacobian)
        if size.min() <= 0.0:
            raise ValueError(f"{int((size.min(axis=1) <= 0.0).sum())} tetrahedra are inverted. Choose another edge.")
        self.weights = size * element.weights  # [cell, point], volumes
        self.volumes = self.weights.sum(axis=1)
        dense = np.broadcast_to(np.asarray(density, float), count)
        masses = (matter.density * dense * self.volumes)[:, None] * element.lumps
        mass = _at_nodes(mesh, masses)
        self.shares = _at_nodes(mesh, self.volumes[:, None] * element.shares / self.volumes.sum())
        stiff = np.ones((count, points)) * stiffness
        mu, lam = matter.lame
        directions = np.broadcast_to([1.0, 0.0, 0.0], (count, points, 3)) if fibres is None else fibres
        self.fibres = directions
        self.membership = np.zeros((count, points, 1)) if membership is None else membership
        inverse = np.linalg.inv(jacobian).reshape(count, points, 9)
        self.weight = matter.gravity * mass
        self._laplacian, heavier = _largest(mesh.cells, inverse, self.weights, element, mass)
        self.blocks = -(-count // LANES)
        self._cells = np.ascontiguousarray(_lanes(mesh.cells, self.blocks), np.int32)
        self._arrays = {
            "slopes": element.slopes, "inverse": _lanes(inverse, self.blocks), "pulled": _lanes(inverse, self.blocks),
            "volume": _lanes(self.weights, self.blocks, 0.0), "fibre": _lanes(directions, self.blocks),
            "mu": _lanes(mu * stiff, self.blocks), "lam": _lanes(lam * stiff, self.blocks),
            "tension": _lanes(np.zeros((count, points)), self.blocks),
        }  # fmt: skip
        self._arrays = {name: np.asarray(array, np.float32) for name, array in self._arrays.items()} | {
            **_pieces(mesh), "mass": heavier, "weight": self.weight, "stage": np.zeros((2, *mesh.points.shape)),
            "way": np.zeros((len(mesh.points), 2)), "held": np.zeros(len(mesh.points), np.int32),
        }  # fmt: skip
        self._arrays = {name: _aligned(array) for name, array in self._arrays.items()}
        self.mass = self._arrays["mass"]
        self.x, self.v = mesh.points.copy(), np.zeros_like(mesh.points)
        self.force, self.push = np.zeros_like(self.x), np.zeros(len(self.x))
        self.steps, self._stages = 0, 1

    def _body(self) -> _Body:
        m = self.matter
        places = {name: array.ctypes.data for name, array in self._arrays.items()}
        nodal = {name: getattr(self, name).ctypes.data for name in ("x", "v", "force", "push")}
        return _Body(
            blocks=self.blocks, node_count=len(self.x), pieces=len(self._arrays["piece"]), stages=self._stages,
            cells=self._cells.ctypes.data, eta=m.viscosity, friction=m.friction, slope=m.slope, thickness=m.thickness,
            rate=m.stiffness / m.thickness**2, **places, **nodal,
        )  # fmt: skip

    def pull(self, tensions: Array) -> None:
        """Set the tension of every muscle `[muscle]` [Pa]."""
        self._arrays["tension"][...] = _lanes(self.membership @ np.asarray(tensions, float), self.blocks)

    def largest_step(self) -> tuple[float, float, float]:
        """The largest stable steps now [s], by elasticity and by explicit viscosity, and the least J."""
        stiff, viscous, least = (np.zeros(self.blocks * LANES) for _ in range(3))
        call = getattr(_library(), f"survey{self.nodes}")
        call(ctypes.byref(self._body()), *(ctypes.c_void_p(a.ctypes.data) for a in (stiff, viscous, least)))
        count = len(self._laplacian)
        w, c = (stiff[:count] * self._laplacian).max(), (viscous[:count] * self._laplacian).max()
        return 2.0 / float(np.sqrt(w)), 2.0 / max(float(c), 1e-12), float(least[:count].min())

    def advance(self, seconds: float, finer: float = 1.0) -> float:
        """Move for so long with steps that are safe now, or `finer` ones; returns the least J before."""
        elastic, viscous, least = self.largest_step()
        fastest = float(np.sqrt((self.v**2).sum(axis=1).max())) + 1e-6
        step = min(_COURANT * elastic, _SKIN_STEP * self.matter.thickness / fastest) * finer
        steps = int(np.ceil(seconds / step))
        # s stages are stable up to (s^2 + s) / 2 explicit steps
        self._stages = max(1, int(np.ceil(0.5 * (np.sqrt(1.0 + 8.0 * seconds / steps / (_VISCOUS * viscous)) - 1.0))))
        call = getattr(_library(), f"run{self.nodes}")
        call(ctypes.byref(self._body()), ctypes.c_int(steps), ctypes.c_double(seconds / steps))
        self.steps += steps
        return least

    def carried(self) -> float:
        """Force of the layer on the body where it is [N]."""
        _library().ground_only(ctypes.byref(self._body()))
        return float(self.push.sum())

    def stand(self) -> None:
        """Lift or lower the body to where the layer carries its weight."""
        weight = float(self.weight.sum())
        rest = self.x.copy()
        low, high = -self.matter.thickness, self.matter.thickness
        for _ in range(40):
            middle = 0.5 * (low + high)
            self.x[:] = rest + np.array([0.0, middle - rest[:, 1].min(), 0.0])
            low, high = (middle, high) if self.carried() > weight else (low, middle)

    def settle(self, frames: int = 40, rounds: int = 20) -> float:
        """Come to rest as zoobench does, by dynamic relaxation: stop whenever the kinetic energy falls.

        After so many frames it goes on for half as many at a time until the centre of mass has stopped along
        the ground.

        Returns:
            the horizontal speed of the centre of mass in the last round [m/s].
        """
        speed = np.inf
        for number in range(rounds + 1):
            count, place, before = frames if number == 0 else frames // 2, self.mass @ self.x / self.mass.sum(), 0.0
            for _ in range(count):
                self.advance(FRAME)
                energy = self.kinetic()
                if energy < before:
                    self.v[:] = energy = 0.0
                before = energy
            self.v[:] = 0.0
            speed = float(np.hypot(*(self.mass @ self.x / self.mass.sum() - place)[[0, 2]])) / (count * FRAME)
            if speed < _REST_SPEED and number:
                break
        return speed

    def kinetic(self) -> float:
        """Kinetic energy [J]."""
        return float(0.5 * (self.mass * (self.v**2).sum(axis=1)).sum())

    def mean(self, values: Array) -> Array:
        """Mean of a nodal quantity over the volume at rest."""
        return self.shares @ values

    def quadrature_places(self) -> Array:
        """Places at rest of the quadrature points `[cell, point, 3]` [m]."""
        found: Array = np.einsum("qa,eai->eqi", self.element.values, self.mesh.points[self.mesh.cells])
        return found

    def gradients(self, values: Array) -> Array:
        """Gradients at the quadrature points by places at rest `[cell, point, 3, 3]` of a nodal vector."""
        jacobian = np.einsum("eai,qac->eqic", self.mesh.points[self.mesh.cells], self.element.slopes)
        found: Array = np.einsum("eai,qac->eqic", values[self.mesh.cells], self.element.slopes) @ np.linalg.inv(
            jacobian
        )
        return found


def _at_nodes(mesh: Mesh, values: Array) -> Array:
    """Sums over elements of values at their nodes `[cell, node]`, at every node."""
    return np.bincount(mesh.cells.ravel(), values.ravel(), len(mesh.points)).astype(np.float64)


def _largest(cells: Indices, inverse: Array, weights: Array, element: Element, mass: Array) -> tuple[Array, Array]:
    """Largest eigenvalue of every element's Laplacian `[cell]` [1/(kg/m^3 m^2)], and the masses it holds for [kg].

    A node's mass is divided among its elements in proportion to their stiffness there: a sliver gets most of it. The
    nodes that would make steps small by themselves are heavier, by inertia and not by weight, by a thousandth in all.
    """
    slopes = np.einsum("qac,eqcd->eqad", element.slopes, inverse.reshape(*inverse.shape[:2], 3, 3))
    matrix = np.einsum("eqac,eqbc,eq->eab", slopes, slopes, weights)
    own = np.einsum("eaa->ea", matrix)
    total = np.bincount(cells.ravel(), own.ravel(), len(mass))
    heavier = np.maximum(mass, total / (_FASTEST_NODE * np.median(total / mass)))
    scale = 1.0 / np.sqrt(heavier[cells] * own / total[cells])
    found: Array = np.linalg.eigvalsh(matrix * scale[:, :, None] * scale[:, None, :])[:, -1]
    return found, heavier


def _pieces(mesh: Mesh) -> dict[str, Array]:
    """The linear tetrahedra that feel the ground, with their volumes."""
    from benchmarks.judge.meshes import volumes

    found = (
        mesh.cells if mesh.cells.shape[1] == 4 else np.concatenate([mesh.cells[:, list(piece)] for piece in _PIECES])
    )
    return {"piece": np.ascontiguousarray(found, np.int32), "piece_volume": np.abs(volumes(mesh.points, found))}


def _lanes(values: Any, blocks: int, padding: float | None = None) -> Array:
    """Rows of elements `[cell, ...]` as `[block, ..., 8]`; the last is repeated, or padded."""
    missing = blocks * LANES - len(values)
    last = np.repeat(values[-1:], missing, axis=0)
    full = np.concatenate([values, last if padding is None else np.full_like(last, padding)])
    found: Array = np.moveaxis(full.reshape(blocks, LANES, *values.shape[1:]), 1, -1)
    return found


def _aligned(values: Any) -> Array:
    """A contiguous copy that begins at a multiple of 64 bytes."""
    room = np.empty(values.nbytes + 64, np.uint8)
    start = -room.ctypes.data % 64
    found: Array = room[start : start + values.nbytes].view(values.dtype).reshape(values.shape)
    found[...] = values
    return found
