"""A manufactured solution: neo-Hookean matter driven through a known motion of large strain by a body force
(Wallstedt & Guilkey 2008, axis-aligned displacement in a periodic unit square).
"""

import math
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import WEIGHTLESS, Rig, lattice, order_of_accuracy, passive_body

_SOURCE = "Wallstedt & Guilkey 2008, An evaluation of explicit time integration schemes for use with GIMP"
_GRIDS = "8, 16, 32 cells, 3 particles per axis, CFL 0.3"

MATERIAL = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1000.0)
AMPLITUDE = 0.05
"""Amplitude of the displacement [m] in the unit square."""

_SPEED = math.sqrt(MATERIAL.youngs_modulus / MATERIAL.density)
_PERIOD = 2.0 / _SPEED
_GHOSTS = 5  # rest cells of images around the square: the reach of two stencils when compressed to two thirds
_CELLS = (8, 16, 32)
_PHASES = np.array([0.0, math.pi])


def displacement(X: Array, t: float) -> Array:
    """u `[.., 2]` [m] at rest positions `[.., 2]`: A sin(2 pi X) sin(c pi t) and A sin(2 pi Y) sin(c pi t + pi)."""
    return AMPLITUDE * np.sin(2 * math.pi * X) * np.sin(_SPEED * math.pi * t + _PHASES)


def stretches(X: Array, t: float) -> Array:
    """F_xx and F_yy `[.., 2]`; F is diagonal."""
    return 1 + 2 * math.pi * AMPLITUDE * np.cos(2 * math.pi * X) * np.sin(_SPEED * math.pi * t + _PHASES)


def body_force(X: Array, t: float) -> Array:
    """Acceleration `[.., 2]` [m/s^2] that drives the motion: u_tt - div P / rho.

    P_xx = (mu (F_xx^2 - 1) + lambda log(F_xx F_yy)) / F_xx depends on X through F_xx alone, and so
    div P = F_xx,X (mu + (mu + lambda (1 - log J)) / F_xx^2) with F_xx,X = -4 pi^2 u_x.
    """
    mu, lam = MATERIAL.lame
    stretch = stretches(X, t)
    log_j = np.log(stretch.prod(-1, keepdims=True))
    stiffness = mu + (mu + lam * (1 - log_j)) / stretch**2
    inertia = -((_SPEED * math.pi) ** 2)
    result: Array = displacement(X, t) * (inertia + 4 * math.pi**2 * stiffness / MATERIAL.density)
    return result


def _velocity(X: Array, t: float) -> tuple[Array, Array]:
    """Velocity `[.., 2]` [m/s] and velocity gradient's diagonal `[.., 2]` [1/s]."""
    swing = _SPEED * math.pi * np.cos(_SPEED * math.pi * t + _PHASES)
    gradient = 2 * math.pi * AMPLITUDE * np.cos(2 * math.pi * X) * swing / stretches(X, t)
    return AMPLITUDE * np.sin(2 * math.pi * X) * swing, gradient


class Driven:
    """The square with periodic images around it, one layer of particles thick, in plane strain.

    After every substep the images take the state of their originals, and all matter is returned to its plane.

    Args:
        cells: of the grid along a side of the square.
        per_axis: particles per cell along an axis.

    Attributes:
        rig: the square and its images, advanced by `error`.
    """

    def __init__(self, cells: int, per_axis: int = 3, **settings: Any) -> None:
        h = 1 / cells
        edge = (_GHOSTS + 3) * h  # of the square; the images keep clear of the arena's walls
        low, high = edge - _GHOSTS * h, edge + 1 + _GHOSTS * h
        points = lattice((low, low, h), (high, high, 2 * h), (h / per_axis, h / per_axis, h))
        self._X, self._points = points[:, :2] - edge, points
        size = 1 + 2 * edge
        scene = Scene(
            passive_body(MATERIAL, points, h**3 / per_axis**2), (0, 0, 0), (size, size, 3 * h), gravity=WEIGHTLESS
        )
        # CFL 0.3 with the speed of pressure waves
        self.rig = Rig(scene, h, 0.75 * _PERIOD, courant=0.42, **settings)
        inside = ((self._X > 0) & (self._X < 1)).all(1)
        self._square, self._image = np.flatnonzero(inside), np.flatnonzero(~inside)
        sites = np.rint(self._X * cells * per_axis - 0.5).astype(int) % (cells * per_axis)
        number = sites @ [cells * per_axis, 1]
        self._original = self._square[np.argsort(number[self._square])][number[self._image]]
        velocity, gradient = _velocity(self._X, -self.rig.dt / 2)  # symplectic Euler has it half a substep back
        self.rig.v[:, :2] = velocity
        self.rig.C[:, [0, 1], [0, 1]] = gradient

    def error(self) -> Array:
        """Root mean square error of the displacement's components, over the amplitude `[steps + 1]`."""
        rig, found = self.rig, [0.0]
        for n in range(rig.steps):
            rig.v[:, :2] += rig.dt * body_force(self._X, n * rig.dt)
            rig.advance(1)
            self._constrain()
            moved = (rig.positions - self._points)[:, :2] - displacement(self._X, (n + 1) * rig.dt)
            found.append(math.sqrt((moved[self._square] ** 2).mean()) / AMPLITUDE)
        return np.array(found)

    def _constrain(self) -> None:
        """Periodic images, and no motion in z."""
        rig, image, original = self.rig, self._image, self._original
        rig.v[:, 2] = 0.0
        rig.C[:, 2, :] = 0.0
        rig.F[:, 2, :] = [0.0, 0.0, 1.0]
        for state in (rig.v, rig.C, rig.F):
            state[image] = state[original]
        places = rig.positions
        places[:, 2] = self._points[:, 2]
        places[image] = places[original] + self._points[image] - self._points[original]
        rig.place(slice(None), places)


@case("manufactured-solution-single", _SOURCE, _GRIDS, args=(32,), precision=32, is_fast=False)
@case("manufactured-solution", _SOURCE, _GRIDS, args=(64,))
def manufactured(record: CaseRecorder, precision: int) -> None:
    """Displacement error in the manufactured solution, and its order."""
    runs = [Driven(cells, precision=precision) for cells in _CELLS]
    errors = [run.error() for run in runs]
    worst = np.array([error.max() for error in errors])
    spacings = 1 / np.array(_CELLS)
    record.at_most("displacement error over amplitude at 32 cells", worst[-1], 1.5e-3)
    record.at_least("order of the error from 16 to 32 cells", order_of_accuracy(spacings[1:], worst[1:]), 1.8)
    figure = record.plot(
        f"Manufactured solution in float{precision}",
        "time over period [-]",
        "rms displacement error over A [-]",
        log="y",
    )
    for cells, error in zip(_CELLS, errors, strict=True):
        figure.computed(f"{cells} cells", np.linspace(0, 0.75, len(error))[1:], error[1:])
    figure.level("bound at 32 cells", np.array([0.0, 0.75]), 1.5e-3)
