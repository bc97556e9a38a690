"""A robot in its rest frame in equilibrium: rods of few cells, bent by their weight or by a muscle, and a muscle."""

import math
from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.rig import WEIGHTLESS, Rig, Vector, lattice, passive_body
from zoobench_verify.validate.statics import MUSCLE, check_stretches

_CELLS = (1, 2, 3, 4)
"""Through the thickness of a rod."""
_THICK = 0.02
"""Of a rod, in both directions [m]."""
_STRAIN = 2e-3
"""Of a layer that contracts [-]: small, so that the rod is linear."""
_SAG = 0.01
"""Of a rod that is held at one end, over its length."""
_SLENDER, _SHORT = 10, 6
"""Lengths of a rod that is held and of one with two layers [thicknesses]."""

_BOUNDS = 0.95, 1.05
"""Of a deflection over the exact one."""

_LOCKING = "cells of eight points lock as matter becomes incompressible"
_DRAWN = "a cell of one layer has its strain nearer to its middle than its muscle is, which has less of a lever there"
_STIFF_RODS = {cells: Shortfall(_LOCKING, worst) for cells, worst in zip(_CELLS, (0.8, 0.75, 0.81, 0.85), strict=True)}
_STIFF_LAYERS = {
    1: Shortfall(_DRAWN, 0.81),
    2: Shortfall(_LOCKING, 0.87),
    3: Shortfall(_LOCKING, 0.88),
    4: Shortfall(_LOCKING, 0.92),
}
_COARSE_LAYERS = {1: Shortfall(_DRAWN, 0.93)}
"""By the cells through the thickness."""


def _rod(cells: int, slender: int, material: ElasticMaterial) -> tuple[Scene, float]:
    """A rod along x in free flight, one of its ends at x = 0, and its grid spacing [m]."""
    h = _THICK / cells
    points = lattice((0.0, 0.0, 0.0), (slender * _THICK, _THICK, _THICK), h / 2)
    room: Vector = (2.0 * slender * _THICK, 2.0 * _THICK, 2.0 * _THICK)
    return Scene(passive_body(material, points, (h / 2) ** 3), (0, 0, 0), room, gravity=WEIGHTLESS), h


def bending_rate(mode: float, slender: int, material: ElasticMaterial) -> float:
    """Angular frequency [rad/s] of a rod of Euler and Bernoulli: (mode / l)^2 sqrt(E I / (rho A))."""
    stiffness = material.youngs_modulus * _THICK**2 / 12.0 / material.density
    return (mode / (slender * _THICK)) ** 2 * math.sqrt(stiffness)


def timoshenko_sag(material: ElasticMaterial, gravity: float, x: float) -> float:
    """Sag [m] at `x` [m] of a square rod that is held at x = 0, under its weight at `gravity` [m/s^2].

    Bending, and shear with the factor of Cowper 1966, 10 (1 + nu) / (12 + 11 nu).
    """
    load, length = material.density * gravity, _SLENDER * _THICK
    modulus, nu = material.youngs_modulus, material.poissons_ratio
    bending = load * x**2 * (6 * length**2 - 4 * length * x + x**2) / (2 * modulus * _THICK**2)
    factor = 10 * (1 + nu) / (12 + 11 * nu)
    return bending + load * (length * x - x**2 / 2) / (factor * modulus / (2 + 2 * nu))


def held_rod(cells: int, material: ElasticMaterial) -> tuple[Array, Array]:
    """Abscissae [m] and sags over Timoshenko's at the end, of a rod whose nodes at x = 0 are put back every substep."""
    scene, h = _rod(cells, _SLENDER, material)
    gravity = 2 * _SAG * material.youngs_modulus * _THICK**2 / (3 * material.density * (_SLENDER * _THICK) ** 3)
    omega = bending_rate(1.8751, _SLENDER, material)
    rig = Rig(replace(scene, gravity=(0.0, -gravity, 0.0)), h, 12 / omega, courant=0.9, robot="lagrangian")
    ends = np.flatnonzero(rig.places[:, 0] < rig.places[:, 0].min() + h / 2)
    rest = rig.places[ends].copy()
    for _ in range(rig.steps):
        rig.advance(1)
        rig.places[ends], rig.velocities[ends] = rest, 0.0
        rig.damp(2 * omega)
    x, sunk = _along(scene, scene.robot.positions - rig.positions)
    return x, sunk / timoshenko_sag(material, gravity, float(x[-1]))


def _along(scene: Scene, moved: Array) -> tuple[Array, Array]:
    """Abscissae [m] of the sections of a rod, and the mean displacement of each along y [m]."""
    x, section = np.unique(scene.robot.positions[:, 0], return_inverse=True)
    section = section.ravel()
    return x, np.bincount(section, moved[:, 1]) / np.bincount(section)


def two_layers(cells: int, material: ElasticMaterial) -> tuple[Array, Array]:
    """Abscissae [m] and deflections [m] of a free rod whose upper half contracts."""
    scene, h = _rod(cells, _SHORT, material)
    omega = bending_rate(4.7300, _SHORT, material)
    robot = scene.robot
    active = replace(robot, muscle_membership=(robot.positions[:, 1:2] > _THICK / 2).astype(float))
    scene = replace(scene, robot=active)
    rig = Rig(scene, h, 12 / omega, courant=0.9, robot="lagrangian")
    rig.solver.parameters.tension[0] = rig.solver.parameters.tension.new_tensor(
        _STRAIN * material.youngs_modulus * active.muscle_membership[:, 0]
    )
    rig.equilibrate(2 * omega, rig.steps)
    return _along(scene, rig.positions - robot.positions)


def curvature(x: Array, deflection: Array) -> float:
    """Curvature [1/m] of the middle half of a rod."""
    middle = np.abs(x - x.mean()) < x.mean() / 2
    return float(2.0 * np.polyfit(x[middle], deflection[middle], 2)[0])


def timoshenko_curvature() -> float:
    """Of two layers of one modulus and thickness (Timoshenko 1925), one contracted by `_STRAIN`: 1.5 e / t [1/m]."""
    return 1.5 * _STRAIN / _THICK


@case(
    "rest-frame-cantilever",
    "Timoshenko 1921, beam with shear; Cowper 1966",
    "rods of 1, 2, 3 and 4 cells",
    is_fast=False,
)
def cantilever(record: CaseRecorder) -> None:
    """A rod of ten thicknesses that is held at one end sags under its weight, at three of Poisson's ratios."""
    figure = record.plot("Rod that is held at one end, Poisson's ratio 0.2", "distance from the end [m]", "sag [-]")
    for nu in (0.0, 0.2, 0.49):
        material = replace(MUSCLE, poissons_ratio=nu)
        for cells in _CELLS:
            x, sag = held_rod(cells, material)
            known = _STIFF_RODS[cells] if nu == 0.49 else None
            what = f"sag over the exact one, nu = {nu:g}, {cells} cells thick"
            record.within(what, sag[-1], *_BOUNDS, shortfall=known)
            if nu == 0.2:
                figure.computed(f"rest frame, {cells} cells thick", x, sag, points=True)
    line = np.linspace(0.0, _SLENDER * _THICK, 101)
    exact = np.array([timoshenko_sag(MUSCLE, 1.0, place) for place in line])
    figure.reference("Timoshenko", line, exact / exact[-1])


@case("rest-frame-bilayer", "Timoshenko 1925: curvature 3/2 e / t", "rods of 1, 2, 3 and 4 cells")
def bilayer(record: CaseRecorder) -> None:
    """A free rod, whose upper half a muscle contracts a little, curves, at three of Poisson's ratios."""
    figure = record.plot("Rod with a muscle in its upper half", "thickness [cells]", "curvature over the exact one [-]")
    for nu in (0.0, 0.2, 0.49):
        material = replace(MUSCLE, poissons_ratio=nu)
        known = _STIFF_LAYERS if nu == 0.49 else _COARSE_LAYERS
        found = []
        for cells in _CELLS:
            found.append(curvature(*two_layers(cells, material)) / timoshenko_curvature())
            what = f"curvature over the exact one, nu = {nu:g}, {cells} cells thick"
            record.within(what, found[-1], *_BOUNDS, shortfall=known.get(cells))
        figure.computed(f"rest frame, nu = {nu:g}", np.array(_CELLS, float), np.array(found), points=True)
    figure.reference("Timoshenko", np.array([_CELLS[0], _CELLS[-1]], float), np.ones(2))


@case("rest-frame-muscle", "closed form of the free active block", "block of 2³ cells")
def muscle(record: CaseRecorder) -> None:
    """Equilibrium stretches of a free muscle in its rest frame at five activations."""
    check_stretches(record, cells=2, robot="lagrangian")
