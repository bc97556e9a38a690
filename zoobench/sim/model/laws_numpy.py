"""NumPy twins of the constitutive laws: the same formulas without Taichi, for tests and for scenes and energies.

Arrays may have leading axes; the last two are the tensor's.
"""

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.matter import (
    LARGEST_PLASTIC,
    LARGEST_RATIO,
    SMALLEST_PLASTIC,
    SMALLEST_RATIO,
    TOLERATED_SURPLUS,
    ClayMaterial,
    Law,
    Medium,
    MudMaterial,
    SandMaterial,
    SnowMaterial,
    WaterMaterial,
)

Yielding = SandMaterial | ClayMaterial | MudMaterial


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


def hencky_energy(strain: Array, mu: float, lam: float) -> Array:
    """Energy density [J/m^3] mu eps:eps + lambda/2 tr(eps)^2 of principal Hencky strains `[..., 3]`."""
    result: Array = mu * np.square(strain).sum(-1) + 0.5 * lam * strain.sum(-1) ** 2
    return result


def radial_return(material: Yielding, strain: Array, history: Array) -> tuple[Array, Array, Array]:
    """Yield of sand, clay and mud in principal Hencky strains `[..., 3]`, history `[...]` (see `hencky.radial_return`).

    Returns the elastic strain, the new history and the ratio of the deviator kept: 1 elastic, 0 loose sand.
    """
    mu, lam, bound, *_ = material.constants
    total = strain.sum(-1)
    volume = total + history
    deviator = strain - total[..., None] / 3.0
    size = np.linalg.norm(deviator, axis=-1)
    loose = np.zeros(volume.shape, dtype=bool)
    limit = np.full(volume.shape, bound / (2.0 * mu))
    if isinstance(material, SandMaterial):
        loose = volume >= 0.0
        limit = -bound * (3.0 * lam + 2.0 * mu) / (2.0 * mu) * volume
    sheared = ~loose & (size > limit)
    keep = np.where(loose, 0.0, np.where(sheared, limit / np.where(size > 0, size, 1.0), 1.0))
    elastic = np.where(loose[..., None], 0.0, keep[..., None] * deviator + volume[..., None] / 3.0)
    return elastic, np.where(loose, volume, 0.0), keep


def snow_return(material: SnowMaterial, strain: Array, plastic: Array) -> tuple[Array, Array]:
    """Clamped elastic Hencky strains `[..., 3]` of snow and its new plastic volume ratio `[...]`."""
    low, high = 1.0 - material.critical_compression, 1.0 + material.critical_stretch
    elastic = np.clip(strain, np.log(low), np.log(high))
    grown = plastic * np.exp((strain - elastic).sum(-1))
    return elastic, np.clip(grown, SMALLEST_PLASTIC, LARGEST_PLASTIC)


def water_pressure(material: WaterMaterial, J: Array) -> Array:
    """Kirchhoff pressure [Pa] J p of the Tait equation p = K/gamma (J^-gamma - 1) at the volume ratio J; no tension."""
    bulk, gamma = material.bulk_modulus, material.exponent
    return np.maximum(bulk / gamma * (J ** (1.0 - gamma) - J), 0.0)


def water_ratio(J: Array, growth: Array, rho: Array, share: float) -> Array:
    """New volume ratio of water from the old one, det(I + dt C) and the relative density (see `water.water_ratio`)."""
    held = np.minimum(J * growth, np.clip(1.0 / rho, 1.0, LARGEST_RATIO))
    surplus = np.maximum(rho * J - 1.0 - TOLERATED_SURPLUS, 0.0)
    return np.maximum(held - share * surplus, np.minimum(held, SMALLEST_RATIO))


def principal_stress(material: Medium, strain: Array, plastic: Array | float = 1.0) -> Array:
    """Principal Kirchhoff stresses [Pa] of a medium at principal elastic Hencky strains `[..., 3]`, at rest.

    `plastic` is the plastic volume ratio of snow, `[...]` or one for all.
    """
    mu, lam, *_ = material.constants
    volume = strain.sum(-1, keepdims=True)
    J = np.exp(volume)
    result: Array
    if isinstance(material, WaterMaterial):
        result = -water_pressure(material, J) + 0.0 * strain
    elif isinstance(material, SnowMaterial):
        stretch = np.exp(strain)
        hardening = np.exp(material.hardening * (1.0 - np.asarray(plastic)[..., None]))
        result = hardening * (2.0 * mu * stretch * (stretch - 1.0) + lam * J * (J - 1.0))
    elif material.law is Law.MUD:
        bulk = lam + 2.0 / 3.0 * mu
        result = 2.0 * mu * (strain - volume / 3.0) + np.minimum(bulk * J * (J - 1.0), 0.0)
    else:
        result = 2.0 * mu * strain + lam * volume
    return result


def medium_energy(material: Medium, strain: Array, plastic: Array | float = 1.0) -> Array:
    """Energy density [J/m^3] `[...]` whose derivative by the elastic Hencky strains gives `principal_stress`."""
    mu, lam, *_ = material.constants
    volume = strain.sum(-1)
    J = np.exp(volume)
    result: Array
    if isinstance(material, WaterMaterial):
        bulk, gamma = material.bulk_modulus, material.exponent
        pressed = np.minimum(J, 1.0)
        result = bulk / gamma * ((pressed ** (1.0 - gamma) - 1.0) / (gamma - 1.0) + pressed - 1.0)
    elif isinstance(material, SnowMaterial):
        soft = mu * np.square(np.exp(strain) - 1.0).sum(-1) + 0.5 * lam * (J - 1.0) ** 2
        result = np.exp(material.hardening * (1.0 - np.asarray(plastic))) * soft
    elif material.law is Law.MUD:
        deviator = strain - volume[..., None] / 3.0
        result = mu * np.square(deviator).sum(-1) + 0.5 * (lam + 2.0 / 3.0 * mu) * np.minimum(J - 1.0, 0.0) ** 2
    else:
        result = hencky_energy(strain, mu, lam)
    return result
