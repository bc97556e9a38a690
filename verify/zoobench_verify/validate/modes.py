"""Free vibrations of a block against an independent solution: Rayleigh and Ritz with polynomials.

A robot in the air is such a block. Its solution knows no grid, no particles and no time steps.
"""

import math
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

from zoobench.arrays import Array
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.rig import WEIGHTLESS, Rig, Vector, lattice, order_of_accuracy, passive_body
from zoobench_verify.validate.waves import fit_decay

MATERIAL = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1000.0)
SIZE: Vector = (4.0, 1.0, 1.0)
"""Size of the block [m]."""

_RIGID = 6
"""Motions of a free body without strain: the first modes, of frequency zero."""


class Modes(NamedTuple):
    """Modes of vibration of a free block about its centre.

    Attributes:
        omega: angular frequencies `[count]` [rad/s], rising.
        exponents: of x, y and z in every polynomial `[terms, 3]`.
        coefficients: `[count, 3, terms]`.
    """

    omega: Array
    exponents: Array
    coefficients: Array

    def shape(self, mode: int, points: Array) -> tuple[Array, Array]:
        """Displacements `[n, 3]` of a mode at points `[n, 3]` [m] and their gradients `[n, 3, 3]`."""
        powers, own = self.exponents, self.coefficients[mode]
        displacements = np.prod(points[:, None] ** powers, axis=2) @ own.T
        gradients = np.empty((len(points), 3, 3))
        for d in range(3):
            lower = np.maximum(powers - np.eye(3, dtype=int)[d], 0)
            gradients[:, :, d] = (powers[:, d] * np.prod(points[:, None] ** lower, axis=2)) @ own.T
        return displacements, gradients


def block_modes(material: ElasticMaterial, size: Vector, count: int, degree: int = 8) -> Modes:
    """The first `count` modes of a free block that are not rigid, by polynomials up to a degree (Visscher et al. 1991).

    The integrals of the products of polynomials over a box are closed forms, so that kinetic and elastic energy are.
    """
    powers = np.array([p for p in product(range(degree + 1), repeat=3) if sum(p) <= degree])
    terms, half = len(powers), np.array(size) / 2

    def integral(p: Array) -> Array:
        even = (p >= 0).all(-1) & (p % 2 == 0).all(-1)
        p = np.maximum(p, 0)
        result: Array = even * np.prod(2 * half ** (p + 1) / (p + 1), axis=-1)
        return result

    total = powers[:, None] + powers[None]
    unit = np.eye(3, dtype=int)
    slopes = {
        (a, b): np.outer(powers[:, a], powers[:, b]) * integral(total - unit[a] - unit[b])
        for a, b in product(range(3), repeat=2)
    }
    mu, lam = material.lame
    laplacian = mu * sum(slopes[d, d] for d in range(3))
    stiffness = np.block(
        [[lam * slopes[i, k] + mu * slopes[k, i] + (i == k) * laplacian for k in range(3)] for i in range(3)]
    )
    mass = np.kron(np.eye(3), material.density * integral(total))
    squares, vectors = eigh(stiffness, mass, subset_by_index=[_RIGID, _RIGID + count - 1])
    return Modes(np.sqrt(squares), powers, vectors.T.reshape(count, 3, terms))


class Vibration(NamedTuple):
    """A simulated mode: its frequency over the exact one, the share of the amplitude lost in a period, and its path."""

    frequency: float
    loss: float
    t: Array
    amplitude: Array


def vibrate(modes: Modes, mode: int, cells: int, **settings: Any) -> Vibration:
    """Two periods of the block, `cells` thick, that begins with a small velocity of the shape of a mode."""
    h, margin, strain = SIZE[1] / cells, 3 / cells, 1e-3
    points = lattice((0, 0, 0), SIZE, h / 2) + margin
    shape, gradients = modes.shape(mode, points - (np.array(SIZE) / 2 + margin))
    omega = float(modes.omega[mode])
    scale = strain * omega / np.abs(gradients).max()
    body = passive_body(MATERIAL, points, h**3 / 8)
    upper = (SIZE[0] + 2 * margin, SIZE[1] + 2 * margin, SIZE[2] + 2 * margin)
    scene = Scene(body, (0, 0, 0), upper, gravity=WEIGHTLESS)
    rig = Rig(scene, h, 4 * math.pi / omega, **settings)
    rig.v[:], rig.C[:] = scale * shape, scale * gradients
    norm = float((shape**2).sum()) * scale
    amplitude = [1.0]
    for _ in range(rig.steps):
        rig.advance(1)
        amplitude.append(float((rig.v * shape).sum()) / norm)
    t, path = rig.times(rig.steps), np.array(amplitude)
    frequency, decay = fit_decay(t, path, omega)
    return Vibration(frequency / omega, 1 - math.exp(-decay * 2 * math.pi / frequency), t, path)


_DAMPED = "the transfer damps motion that varies within a few cells"
_KINDS = {"bending": 0, "torsion": 2, "stretching": 5}
"""The first mode of each kind among those of `SIZE`."""
_LOSSES = {"bending": None, "torsion": Shortfall(_DAMPED, 0.1), "stretching": None}
_SOURCE = "Visscher et al. 1991, J. Acoust. Soc. Am. 90, 2154: Rayleigh and Ritz"


@case("block-modes", _SOURCE, "3 and 4 cells through the thickness", args=((3, 4), 0.1))
@case("block-modes-fine", _SOURCE, "3, 4, 6, 8 cells through the thickness", args=((3, 4, 6, 8), 0.03), is_fast=False)
def block_modes_case(record: CaseRecorder, cells: tuple[int, ...], bound: float) -> None:
    """Frequencies of a free block that bends, twists and stretches, at the resolution of limbs, and its losses."""
    modes = block_modes(MATERIAL, SIZE, max(_KINDS.values()) + 1)
    spacings = 1 / np.array(cells)
    figure = record.plot("Free block 4 x 1 x 1", "time over the period [-]", "modal velocity over its first value [-]")
    for kind, mode in _KINDS.items():
        found = [vibrate(modes, mode, n) for n in cells]
        errors = np.array([each.frequency - 1 for each in found])
        record.at_most(f"frequency of {kind} at {cells[-1]} cells, relative error", abs(errors[-1]), bound)
        record.within(f"order of that error, {kind}", order_of_accuracy(spacings, errors), 1.5, 2.3)
        record.within(
            f"amplitude of {kind} lost in a period at 4 cells", found[1].loss, 0.0, 0.02, shortfall=_LOSSES[kind]
        )
        record.remark(f"{kind}: " + ", ".join(
            f"{n} cells {error:+.1%}, loss {each.loss:.1%}" for n, error, each in zip(cells, errors, found, strict=True)
        ))  # fmt: skip
        turns = modes.omega[mode] * found[-1].t / (2 * math.pi)
        figure.computed(f"MPM, {kind}, {cells[-1]} cells", turns, found[-1].amplitude)
    figure.reference("without loss", turns, np.cos(2 * math.pi * turns))
