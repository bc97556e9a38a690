"""The largest stable time step: of a scene as declared, and of a world in its present condition.

One bound covers the explicit solver: the isolated particle, dt_iso = h sqrt(rho0 / kappa), where kappa is the stiffness
of the particle's own stress (Sun, Shinar and Schroeder 2020; Bai and Schroeder 2022). Bulk matter tolerates more. A
viscosity eta tightens it: with w = 4 kappa / (rho0 h^2) and d = 8 eta / (rho0 h^2), w dt^2 + 2 d dt <= 4.

Cubic splines have 3 for the first 4 and 6 for the 8, and so allow 2 / sqrt(3) of the step. With PIC the particle's
affine motion is lost between substeps: it does not oscillate but decays, C' = -dt (w e + d C) and e' = e + dt C', whose
roots stay inside the unit circle as long as w dt^2 + 2 d dt <= 2.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from zoobench.errors import StepSizeError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.scene import Scene, has_skin

LARGEST_STRETCH = 1.5
"""Principal stretch of muscle robots up to which the declared step is safe [-]; beyond it, steps become shorter.

At s = 0.3 E a free fibre reaches 1.7, but by pushing, which does not add to the stiffness as contraction does."""

OBJECT_STRETCH = 1.1
"""The same of objects, which have no muscles and are stiffer than what pushes on them."""

LARGEST_COURANT = 0.5
"""Cells that matter may cross in one substep [-], and the bound on dt |C|: det(I + dt C) stays positive below it."""

SPEED_ROOM = 0.8
"""Share of `LARGEST_COURANT` that a step is chosen for, as matter may become faster within a frame."""

REFUSED_FRACTION = 0.9

_REST_FRAME_DAMPING = LARGEST_STRETCH**2
"""Factor by which the viscosity counts more in the rest frame, at that compression."""

SHORTEST_STEP = 8e-7
"""[s] Ten thousand in a control frame of 8 ms, a thousand times as many as the default robot needs at `draft`."""

SKIN_FRACTION = 0.7
"""Largest chosen step by the stable one of matter in the ground's skin [-]."""

SKIN_CROSSING = 0.35
"""Share of the skin's thickness that matter may cross in a chosen step [-]: an impact at the speed
limit gains 0.9 % of energy by it."""

MOST_REFINEMENT = 16
"""Largest ratio of the declared step to a repeated one; a world that needs shorter steps has diverged."""


class Condition(NamedTuple):
    """The condition of a world, from its survey.

    Attributes:
        speed: largest of all particles [m/s].
        shear: largest Frobenius norm of C [1/s].
        beyond: largest distance of matter beyond a wall plane [cells].
        smallest_j: smallest det F of robot and objects.
        guarded: number of particles with J below its guard (`elastic.SMALLEST_J`).
        stretch: upper bound of their largest principal stretch.
        robot_stiffness, medium_stiffness: largest kappa / rho0 [m^2/s^2], at the present actuation, stretch and
            hardening; 0 without such matter.
        robot_viscosity: largest eta / rho0 [m^2/s].
        ground_stiffness: of the ground's skin on the lightest matter, K / (delta^2 rho0) [1/s^2]; 0 without a skin.
    """

    speed: float
    shear: float
    beyond: float
    smallest_j: float
    guarded: float
    stretch: float
    robot_stiffness: float
    medium_stiffness: float
    robot_viscosity: float
    ground_stiffness: float = 0.0


@dataclass(frozen=True)
class StepLimit:
    """The bound on the step, and the step taken.

    Attributes:
        dt_iso: the largest stable step [s].
        matter: the matter that sets it.
        dt: the step taken [s].
        substeps_per_frame: substeps of one control frame.
    """

    dt_iso: float
    matter: str
    dt: float
    substeps_per_frame: int

    @property
    def fraction(self) -> float:
        """The step as a fraction of the largest stable one."""
        return self.dt / self.dt_iso


def isolated_particle_limit(fidelity: Fidelity, stiffness: float, viscosity: float = 0.0) -> float:
    """Largest stable step [s], of `stiffness` kappa / rho0 [m^2/s^2] and `viscosity` eta / rho0 [m^2/s].

    Infinite without either.
    """
    moment, bound = fidelity.spline.inverse_moment, 4.0
    if fidelity.robot == "lagrangian":
        # of an isolated trilinear cell with n particles along its edge, whose lumped masses are those of its corners
        n = round(fidelity.particles_per_cell ** (1 / 3))
        moment = 4.0 * n**2 / (2 * n - 1)
    elif "pic" in (fidelity.transfer, fidelity.medium_transfer):
        bound = 2.0
    scale = moment / fidelity.grid_spacing**2
    damping = 2.0 * viscosity * scale
    # the positive root of scale stiffness dt^2 + 2 damping dt = bound, written without cancellation
    rate = damping + math.sqrt(damping**2 + bound * scale * stiffness)
    return bound / rate if rate > 0.0 else math.inf


def skin_limit(fidelity: Fidelity, stiffness: float) -> float:
    """Largest step [s] on a ground whose skin has this `stiffness` K / (delta^2 rho0) [1/s^2]; infinite without any.

    2 / omega. The skin is linear and never stiffens, so that a chosen step goes up to `SKIN_FRACTION` of it at any
    Courant fraction.
    """
    room = 1.0 if fidelity.step else SKIN_FRACTION / fidelity.courant
    return room * 2.0 / math.sqrt(stiffness) if stiffness > 0.0 else math.inf


def elastic_kappa(mu: float, lam: float, stiffness: float, strength: float, stretch: float) -> float:
    """kappa [Pa] of neo-Hookean matter with muscle: 2 (k mu + s) stretch^2 + 3 k lambda."""
    return 2.0 * (stiffness * mu + strength) * stretch**2 + 3.0 * stiffness * lam


def rest_frame_kappa(mu: float, lam: float, stiffness: float, strength: float, stretch: float) -> float:
    """kappa [Pa] of the same matter on a grid in its rest frame, compressed to 1 / stretch in one direction."""
    k = stiffness
    return k * mu + strength + (k * mu + k * lam * (1.0 + math.log(stretch))) * stretch**2


def step_limits(scene: Scene, fidelity: Fidelity, stiffness_max: float, density_ratio_min: float) -> dict[str, float]:
    """dt_iso [s] of each kind of matter in the scene at its stiffest and lightest."""
    material = scene.robot.material
    mu, lam = lame_parameters(material.youngs_modulus, material.poissons_ratio)
    stiffness = max(stiffness_max, float(scene.robot.stiffness.max()))
    density = material.density * min(density_ratio_min, float(scene.robot.density_ratio.min()))
    kappa_of, damping = (elastic_kappa, 1.0) if fidelity.robot == "mpm" else (rest_frame_kappa, _REST_FRAME_DAMPING)
    kappa = kappa_of(mu, lam, stiffness, material.muscle_strength, LARGEST_STRETCH)
    limits = {"robot": isolated_particle_limit(fidelity, kappa / density, damping * material.viscosity / density)}
    if scene.ground is not None and has_skin(scene):
        lightest = min([density, *(_lowest_density(each.body) for each in scene.objects)])
        limits["ground"] = skin_limit(fidelity, scene.ground.skin.rate / lightest)
    for each in scene.objects:
        limits[object_label(each.name)] = _object_limit(each.body, fidelity)
    if scene.medium is not None:
        medium = scene.medium.material
        limits[medium.name] = _medium_limit(medium, fidelity, medium.kappa / medium.density)
    return limits


def choose_step(
    scene: Scene,
    fidelity: Fidelity,
    frame_seconds: float,
    *,
    stiffness_max: float = 1.0,
    density_ratio_min: float = 1.0,
) -> StepLimit:
    """The declared step: `fidelity.courant` times dt_iso of the stiffest intended state, or the fixed step.

    It is shortened to divide the frame into a whole number of substeps.

    Raises:
        StepSizeError: the fixed step is above 0.9 dt_iso, where simulations with muscles and impacts diverge, or the
            scene needs one that is too short.
    """
    limits = step_limits(scene, fidelity, stiffness_max, density_ratio_min)
    matter = min(limits, key=lambda name: limits[name])
    dt_iso = limits[matter]
    chosen = fidelity.courant * dt_iso
    if not fidelity.step and chosen < SHORTEST_STEP:
        raise StepSizeError(
            f"The {matter} needs steps of {chosen:.3g} s, and {SHORTEST_STEP:.0e} s are the shortest, of which a "
            "control frame of 8 ms has 10,000. Make it softer, weaker or denser."
        )
    count = whole_substeps(frame_seconds, fidelity.step or chosen)
    found = StepLimit(dt_iso, matter, frame_seconds / count, count)
    if found.fraction > REFUSED_FRACTION:
        raise StepSizeError(
            f"A fixed step of {found.dt:.3g} s was asked for, {found.fraction:.2f} of the largest stable one; above "
            f"{REFUSED_FRACTION} it is not safe. The {matter} sets the limit: dt_iso = {dt_iso:.3g} s at a grid "
            f"spacing of {fidelity.grid_spacing:.4g} m. Ask for {0.5 * dt_iso:.2g} s, or for none: then it is chosen."
        )
    return found


def step_now(
    scene: Scene, fidelity: Fidelity, frame_seconds: float, condition: Condition, stiffest: str = "robot"
) -> StepLimit:
    """The step that a world in this condition can take through its next frame.

    `matter` is `speed` (half a cell in a substep), `impact` (the thickness of the ground's skin) or `velocity gradient`
    (dt |C| of a half) where these bounds are the tightest; dt_iso is then chosen so that `courant` times it keeps them.
    `stiffest` names the stiffest of robot and objects.
    """
    h, courant = fidelity.grid_spacing, fidelity.courant
    limits = {stiffest: isolated_particle_limit(fidelity, condition.robot_stiffness, condition.robot_viscosity)}
    if condition.ground_stiffness > 0.0:
        limits["ground"] = skin_limit(fidelity, condition.ground_stiffness)
    if scene.medium is not None:
        medium = scene.medium.material
        limits[medium.name] = _medium_limit(medium, fidelity, condition.medium_stiffness)
    room = SPEED_ROOM * LARGEST_COURANT / courant  # the step taken is courant times the limit
    if condition.speed > 0.0:
        limits["speed"] = room * h / condition.speed
        if scene.ground is not None and has_skin(scene):
            # matter that falls through the skin within a step would gain energy there
            limits["impact"] = SKIN_CROSSING * scene.ground.skin.thickness / condition.speed / courant
    if condition.shear > 0.0:
        limits["velocity gradient"] = room / condition.shear
    matter = min(limits, key=limits.__getitem__)
    count = whole_substeps(frame_seconds, courant * limits[matter])
    return StepLimit(limits[matter], matter, frame_seconds / count, count)


def whole_substeps(frame_seconds: float, dt: float) -> int:
    """Number of equal substeps of at most `dt` [s] in a frame, 1e9 at most; an exact divisor is not rounded up."""
    return max(1, math.ceil(frame_seconds / max(dt, 1e-9 * frame_seconds) - 1e-9))


def object_label(name: str) -> str:
    """An object by name beside other matter, which may be called alike."""
    return name if name.startswith("object") else f"object {name}"


def _object_limit(body: ElasticBody, fidelity: Fidelity) -> float:
    material, density = body.material, _lowest_density(body)
    kappa = elastic_kappa(*material.lame, float(body.stiffness.max()), 0.0, OBJECT_STRETCH)
    return isolated_particle_limit(fidelity, kappa / density, material.viscosity / density)


def _lowest_density(body: ElasticBody) -> float:
    return body.material.density * float(body.density_ratio.min())


def _medium_limit(medium: Medium, fidelity: Fidelity, stiffness: float) -> float:
    viscosity = medium.viscosity if medium.flows else 0.0
    return isolated_particle_limit(fidelity, stiffness, viscosity / medium.density)
