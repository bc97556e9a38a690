"""The largest stable time step of a scene, and the whole number of substeps that a control frame is divided into.

One bound covers the explicit solver: the isolated particle, dt_iso = h sqrt(rho0 / kappa), where kappa is the stiffness
of the particle's own stress . Bulk matter tolerates more.
"""

import math
from dataclasses import dataclass

from zoobench.errors import StepSizeError
from zoobench.sim.matter import lame_parameters
from zoobench.sim.scene import Scene

LARGEST_STRETCH = 1.5
"""Principal stretch up to which the step of muscle robots is safe [-]. At s = 0.3 E a free fibre reaches 1.7, but by
pushing, when its contraction does not add to the stiffness."""

LARGEST_COURANT = 0.5
"""Cells that matter may cross in one substep [-], and the bound on dt |C|: det(I + dt C) stays positive below it."""

REFUSED_FRACTION = 0.9


@dataclass(frozen=True)
class StepLimit:
    """What bounds the step of a scene.

    Attributes:
        dt_iso: the largest stable step [s].
        matter: which matter sets it.
        dt: the step taken [s].
        substeps_per_frame: how many of them make one control frame.
    """

    dt_iso: float
    matter: str
    dt: float
    substeps_per_frame: int

    @property
    def fraction(self) -> float:
        """The step as a fraction of the largest stable one."""
        return self.dt / self.dt_iso


def isolated_particle_limit(grid_spacing: float, density: float, kappa: float) -> float:
    """dt_iso = h sqrt(rho0 / kappa) [s] for quadratic splines."""
    return grid_spacing * math.sqrt(density / kappa)


def elastic_kappa(mu: float, lam: float, stiffness: float, strength: float, stretch: float) -> float:
    """kappa [Pa] of neo-Hookean matter with muscle: 2 (k mu + s) stretch^2 + 3 k lambda."""
    return 2.0 * (stiffness * mu + strength) * stretch**2 + 3.0 * stiffness * lam


def step_limits(scene: Scene, grid_spacing: float, stiffness_max: float, density_ratio_min: float) -> dict[str, float]:
    """dt_iso [s] of each kind of matter in the scene at its stiffest and lightest."""
    material = scene.robot.material
    mu, lam = lame_parameters(material.youngs_modulus, material.poissons_ratio)
    stiffness = max(stiffness_max, float(scene.robot.stiffness.max()))
    ratio = min(density_ratio_min, float(scene.robot.density_ratio.min()))
    kappa = elastic_kappa(mu, lam, stiffness, material.muscle_strength, LARGEST_STRETCH)
    limits = {"robot": isolated_particle_limit(grid_spacing, material.density * ratio, kappa)}
    if scene.medium is not None:
        medium = scene.medium.material
        limits[medium.law.name.lower()] = isolated_particle_limit(grid_spacing, medium.density, medium.kappa)
    return limits


def choose_step(
    scene: Scene,
    grid_spacing: float,
    courant: float,
    frame_seconds: float,
    *,
    stiffness_max: float = 1.0,
    density_ratio_min: float = 1.0,
) -> StepLimit:
    """The step at `courant` times dt_iso or below that divides the frame into a whole number of substeps.

    Raises:
        StepSizeError: `courant` is above 0.9, where muscles and impacts are known to blow up.
    """
    limits = step_limits(scene, grid_spacing, stiffness_max, density_ratio_min)
    matter = min(limits, key=lambda name: limits[name])
    dt_iso = limits[matter]
    if courant > REFUSED_FRACTION:
        raise StepSizeError(
            f"A step of {courant:.3g} dt_iso was asked for; above {REFUSED_FRACTION} it is not safe. The limit of the "
            f"{matter} is dt_iso = {dt_iso:.3g} s. Ask for a Courant fraction of about 0.5."
        )
    count = max(1, math.ceil(frame_seconds / (courant * dt_iso) - 1e-9))
    return StepLimit(dt_iso, matter, frame_seconds / count, count)
