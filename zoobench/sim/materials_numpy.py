"""NumPy twins of the constitutive laws: the same formulas without Taichi, for tests and for the host's own use.

Arrays may have leading axes; the last two are the tensor's.
"""

import numpy as np
from numpy.typing import NDArray

from zoobench.sim.matter import Law, Medium, WaterMaterial

Array = NDArray[np.float64]


def neo_hookean(F: Array, mu: float, lam: float) -> Array:
    """Kirchhoff stress [Pa] mu (F F^T - I) + lambda log(J) I of F `[..., 3, 3]`."""
    log_j = np.log(np.linalg.det(F))[..., None, None]
    result: Array = mu * (F @ np.swapaxes(F, -1, -2) - np.eye(3)) + lam * log_j * np.eye(3)
    return result


def neo_hookean_energy(F: Array, mu: float, lam: float) -> Array:
    """Energy density [J/m^3] mu/2 (tr F^T F - 3) - mu log J + lambda/2 log^2 J; its derivative gives `neo_hookean`."""
    log_j = np.log(np.linalg.det(F))
    result: Array = 0.5 * mu * ((F**2).sum((-1, -2)) - 3.0) - mu * log_j + 0.5 * lam * log_j**2
    return result


def fibre_stress(F: Array, tension: float, fibre: Array) -> Array:
    """Active Kirchhoff stress [Pa] tension (F d)(F d)^T along the unit rest direction d `[..., 3]`."""
    stretched = np.einsum("...ij,...j->...i", F, fibre)
    result: Array = tension * stretched[..., :, None] * stretched[..., None, :]
    return result


def fibre_energy(F: Array, tension: float, fibre: Array) -> Array:
    """Energy density [J/m^3] tension/2 |F d|^2 whose derivative gives `fibre_stress`."""
    result: Array = 0.5 * tension * np.square(np.einsum("...ij,...j->...i", F, fibre)).sum(-1)
    return result


def hencky_energy(strain: Array, mu: float, lam: float) -> Array:
    """Energy density [J/m^3] mu eps:eps + lambda/2 tr(eps)^2 of principal Hencky strains `[..., 3]`."""
    result: Array = mu * np.square(strain).sum(-1) + 0.5 * lam * strain.sum(-1) ** 2
    return result


def drucker_prager(strain: Array, surplus: Array, mu: float, lam: float, slope: float) -> tuple[Array, Array, Array]:
    """Return map of sand in principal Hencky strains `[..., 3]`, surplus `[...]` (see `materials.drucker_prager`)."""
    total = strain.sum(-1)
    volume = total + surplus
    deviator = strain - total[..., None] / 3.0
    size = np.linalg.norm(deviator, axis=-1)
    limit = -slope * (3.0 * lam + 2.0 * mu) / (2.0 * mu) * volume
    loose = volume >= 0.0
    sheared = ~loose & (size > limit)
    keep = np.where(loose, 0.0, np.where(sheared, limit / np.where(size > 0, size, 1.0), 1.0))
    elastic = np.where(loose[..., None], 0.0, keep[..., None] * deviator + volume[..., None] / 3.0)
    return elastic, np.where(loose, volume, 0.0), keep


def sand_update(b: Array, surplus: Array, mu: float, lam: float, slope: float) -> tuple[Array, Array, Array]:
    """Elastic b, new surplus and Kirchhoff stress [Pa] of sand with trial b `[..., 3, 3]`."""
    squares, frame = np.linalg.eigh(b)
    elastic, left, _ = drucker_prager(0.5 * np.log(squares), surplus, mu, lam, slope)
    stress = 2.0 * mu * elastic + lam * elastic.sum(-1, keepdims=True)

    def assemble(values: Array) -> Array:
        assembled: Array = np.einsum("...ij,...j,...kj->...ik", frame, values, frame)
        return assembled

    return assemble(np.exp(2.0 * elastic)), left, assemble(stress)


def principal_stress(material: Medium, strain: Array, plastic: float = 1.0) -> Array:
    """Principal Kirchhoff stresses [Pa] of a medium at principal elastic Hencky strains `[..., 3]`, at rest.

    `plastic` is the plastic volume ratio of snow.
    """
    mu, lam, *_ = material.constants
    volume = strain.sum(-1, keepdims=True)
    J = np.exp(volume)
    result: Array
    if isinstance(material, WaterMaterial):
        bulk, gamma = material.bulk_modulus, material.exponent
        result = -np.maximum(bulk / gamma * (J ** (1.0 - gamma) - J), 0.0) + 0.0 * strain
    elif material.law is Law.SNOW:
        stretch = np.exp(strain)
        hardening = np.exp(material.constants[4] * (1.0 - plastic))
        result = hardening * (2.0 * mu * stretch * (stretch - 1.0) + lam * J * (J - 1.0))
    elif material.law is Law.MUD:
        bulk = lam + 2.0 / 3.0 * mu
        result = 2.0 * mu * (strain - volume / 3.0) + np.minimum(bulk * J * (J - 1.0), 0.0)
    else:
        result = 2.0 * mu * strain + lam * volume
    return result
