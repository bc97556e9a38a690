"""Elastic bodies in equilibrium: a column and a cantilever under their weight, and an active muscle."""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Robot
from zoobench.sim.model.laws.elastic import ElasticMaterial, lame_parameters
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import GRAVITY, NAMES, WEIGHTLESS, Rig, lattice, order_of_accuracy, passive_body

_LOAD = 0.05
"""Weight of the column over its modulus, rho g H / (lambda + 2 mu) [-]."""


def _column_material() -> ElasticMaterial:
    ratio, density = 0.3, 1000.0
    mu, lam = lame_parameters(1.0, ratio)
    return ElasticMaterial(density * GRAVITY / _LOAD / (lam + 2 * mu), ratio, density)


def column_settlement(material: ElasticMaterial, heights: Array) -> Array:
    """Settlement [m] of the points at rest heights `[point_count]` of a confined column 1 m high under gravity.

    Solves P(F) = -rho g (1 - Y) for the stretch, P = (mu (F^2 - 1) + lambda log F) / F, and integrates 1 - F over Y.
    """
    mu, lam = material.lame

    def excess(stretch: float, load: float) -> float:
        return (mu * (stretch**2 - 1) + lam * math.log(stretch)) / stretch + load

    Y = np.linspace(0.0, 1.0, 2001)
    loads = material.density * GRAVITY * (1 - Y)
    stretch = np.array([brentq(excess, 0.5, 1.0, args=(load,), xtol=1e-14) for load in loads])
    sunk = cumulative_trapezoid(1 - stretch, Y, initial=0.0)
    result: Array = np.interp(heights, Y, sunk)
    return result


class Column(NamedTuple):
    """A column in equilibrium under its weight.

    Attributes:
        rig: in its final state.
        error: relative error of the top's settlement.
        height, sunk: rest heights and settlements `[particle_count]` [m].
    """

    rig: Rig
    error: float
    height: Array
    sunk: Array


def column(cells: int, **settings: Any) -> Column:
    """The column of `column_settlement`, of `cells` over its height, damped to rest.

    It is one cell wide between walls and stands on one, and all nodes lie on walls: the column cannot widen.
    """
    h, material = 1 / cells, _column_material()
    points = lattice((0, 0, 0), (h, 1.0, h), h / 2)
    scene = Scene(passive_body(material, points, h**3 / 8), (0, 0, 0), (h, 1.25, h))
    mu, lam = material.lame
    omega = math.pi / 2 * math.sqrt((lam + 2 * mu) / material.density)
    rig = Rig(scene, h, 12 / omega, **settings)
    rig.equilibrate(2 * omega, rig.steps)
    sunk = (points - rig.positions)[:, 1]
    top = points[:, 1] > 1 - h / 2
    exact = float(column_settlement(material, points[top, 1]).mean())
    return Column(rig, float(sunk[top].mean()) / exact - 1, points[:, 1], sunk)


@case("gravity-column", "closed form of the confined neo-Hookean column", "8, 16, 32 cells high")
def gravity_column(record: CaseRecorder) -> None:
    """Settlement of a confined column under its weight, and the order of its error."""
    cells = (8, 16, 32)
    found = [column(n) for n in cells]
    errors = np.abs([each.error for each in found])
    height, sunk = found[-1].height, found[-1].sunk
    fine = np.linspace(0, 1, 101)
    record.at_most("largest error of the top's settlement, over h / H", (errors * cells).max(), 0.4)
    record.at_least("order of the error over 8, 16, 32 cells", order_of_accuracy(1 / np.array(cells), errors), 0.8)
    figure = record.plot(
        "Confined elastic column under gravity, 32 cells", "rest height over H [-]", "settlement over H [-]"
    )
    figure.computed("MPM", height[::16], sunk[::16], points=True)
    figure.reference("nonlinear closed form", fine, column_settlement(_column_material(), fine))


_BEAM = ElasticMaterial(youngs_modulus=1e8, poissons_ratio=0.0, density=1000.0)
_LENGTH, _DEPTH = 10.0, 2.0
_HEAVY = 1e9


def _bend(cells: int) -> tuple[float, Array, Array]:
    """Tip deflection over Timoshenko's, and rest abscissae [m] and deflections [m] of the axis.

    The beam continues behind its root, and from one cell behind it is so heavy that no node within its reach moves:
    the last of these are at the root. Only the light part has weight.
    """
    h = _DEPTH / cells
    root = 6 * h
    points = lattice((root - 4 * h, 2 * h, h), (root + _LENGTH, 2 * h + _DEPTH, 2 * h), (h / 2, h / 2, h))
    light = points[:, 0] > root - h
    body = replace(passive_body(_BEAM, points, h**3 / 4), density_ratio=np.where(light, 1.0, _HEAVY))
    scene = Scene(body, (0, 0, 0), (root + _LENGTH + 2 * h, 4 * h + _DEPTH, 3 * h), gravity=WEIGHTLESS)
    omega = 1.8751**2 * math.sqrt(_BEAM.youngs_modulus * _DEPTH**2 / 12 / _BEAM.density) / _LENGTH**2
    rig = Rig(scene, h, 9 / omega, courant=0.9)
    kick = rig.dt * _gentle_gravity()
    for _ in range(rig.steps):
        rig.v[light, 1] -= kick
        rig.advance(1)
        rig.damp(2 * omega)
    sunk = (points - rig.positions)[:, 1]
    middle = np.abs(points[:, 1] - 2 * h - _DEPTH / 2) < h / 2
    x, along = np.unique(points[middle, 0] - root, return_inverse=True)
    axis = np.bincount(along, sunk[middle]) / np.bincount(along)
    return float(axis[-1] / timoshenko_deflection(x[-1:])[0]), x, axis


def _gentle_gravity() -> float:
    """Gravity [m/s^2] at which the tip of Euler and Bernoulli's beam sinks by a hundredth of the length."""
    stiffness = 2 * _BEAM.youngs_modulus * _DEPTH**2 / (3 * _BEAM.density * _LENGTH**4)
    return 0.01 * _LENGTH * stiffness


def timoshenko_deflection(x: Array) -> Array:
    """Deflection [m] of the beam under its weight at `x` [m] from its root: bending, and shear with the factor 5/6."""
    load = _BEAM.density * _gentle_gravity() * _DEPTH
    bending = load * x**2 * (6 * _LENGTH**2 - 4 * _LENGTH * x + x**2) / (2 * _BEAM.youngs_modulus * _DEPTH**3)
    shear = load * (_LENGTH * x - x**2 / 2) / (5 / 6 * _BEAM.youngs_modulus / 2 * _DEPTH)
    return np.where(x > 0, bending + shear, 0.0)


@case("cantilever", "Timoshenko 1921, beam with shear", "4 and 8 cells through the depth, length 5 depths")
def cantilever(record: CaseRecorder) -> None:
    """Tip deflection of a beam under its weight."""
    cells = (4, 8)
    found = [_bend(n) for n in cells]
    coarse, fine = (abs(row[0] - 1) for row in found)
    _, x, axis = found[-1]
    line = np.linspace(0, _LENGTH, 101)
    record.at_most("tip deflection at 8 cells through the depth, relative error", fine, 0.05)
    record.at_most("the same over that at 4 cells", fine / coarse, 0.8)
    clamped = np.abs(axis[x < -_DEPTH / 8]).max()
    record.at_most("motion of the clamp over the tip's, 8 cells", clamped / axis[-1], 1e-3)
    figure = record.plot("Cantilever under its weight, 8 cells deep", "distance from the clamp [m]", "deflection [m]")
    figure.computed("MPM", x[::4], axis[::4], points=True)
    figure.reference("Timoshenko", line, timoshenko_deflection(line))


MUSCLE = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=3000.0)
_SIDE = 1 / 8  # of the block [m]


def muscle_stretch(activation: float) -> tuple[float, float]:
    """Stretches along and across the fibre of a free block of `MUSCLE` at an activation [-].

    Passive and active stress cancel: mu (l2^2 - 1) + lambda log J = 0 and (mu + s a) l1^2 - mu + lambda log J = 0 with
    J = l1 l2^2.
    """
    mu, lam = MUSCLE.lame
    active = mu + MUSCLE.muscle_strength * activation

    def along(across: float) -> float:
        return math.sqrt(mu * across**2 / active)

    def excess(across: float) -> float:
        return mu * (across**2 - 1) + lam * math.log(along(across) * across**2)

    across = float(brentq(excess, 0.3, 2.0, xtol=1e-14))
    return along(across), across


def muscle_scene(grid_spacing: float, cells: int) -> Scene:
    """A free cube of muscle, its fibres along x."""
    h = grid_spacing
    low = (4 * h,) * 3
    points = lattice(low, (low[0] + cells * h,) * 3, h / 2)
    body = replace(passive_body(MUSCLE, points, h**3 / 8), muscle_membership=np.ones((len(points), 1)))
    return Scene(body, (0, 0, 0), ((cells + 8) * h,) * 3, gravity=WEIGHTLESS)


def contract(activation: float, cells: int = 4, **settings: Any) -> tuple[Rig, float, float]:
    """A free block of 1/8 m, of `cells` along a side, under an activation that rises slowly to the one given.

    Returns:
        the rig in its final state, and the mean stretches along and across the fibre.
    """
    h = _SIDE / cells
    rig = Rig(muscle_scene(h, cells), h, 1.2, **settings)
    speed = math.sqrt(MUSCLE.youngs_modulus / MUSCLE.density)
    rate = 2 * math.pi * speed / (2 * _SIDE)
    tension = rig.solver.parameters.tension
    for n in range(rig.steps):
        level = min(1.0, 1.5 * n / rig.steps)
        tension[:] = MUSCLE.muscle_strength * activation * level
        rig.advance(1)
        rig.damp(rate)
    F = rig.F.astype(float)
    across = np.hypot(F[:, :, 1], F[:, :, 2])
    along = float(np.linalg.norm(F[:, :, 0], axis=1).mean())
    return rig, along, float(np.linalg.norm(across, axis=1).mean() / math.sqrt(2))


@case("muscle-stretch", "closed form of the free active block", "block of 4³ cells")
def muscle(record: CaseRecorder) -> None:
    """Equilibrium stretches of a free muscle at five activations."""
    check_stretches(record)


def check_stretches(record: CaseRecorder, cells: int = 4, robot: Robot = "mpm") -> None:
    """Check the stretches of a free cube of muscle, of so many cells along a side."""
    levels = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    found = np.array([contract(level, cells, robot=robot)[1:] for level in levels])
    exact = np.array([muscle_stretch(level) for level in levels])
    fine = np.linspace(-1, 1, 81)
    smooth = np.array([muscle_stretch(level) for level in fine])
    error = np.abs(found / exact - 1).max(0)
    record.at_most("stretch along the fibre, relative error", error[0], 1e-3)
    record.at_most("stretch across the fibre, relative error", error[1], 1e-3)
    figure = record.plot("Free muscle of strength 0.3 E", "activation [-]", "stretch [-]")
    figure.computed(f"{NAMES[robot]}, along", levels, found[:, 0], points=True)
    figure.computed(f"{NAMES[robot]}, across", levels, found[:, 1], points=True)
    figure.reference("closed form, along", fine, smooth[:, 0])
    figure.reference("closed form, across", fine, smooth[:, 1])
