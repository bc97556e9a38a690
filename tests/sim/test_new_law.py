"""A law of its own in one file: this one, a viscoelastic solid that the package does not know."""
# ruff: noqa: ANN001, ANN201  (the arguments of kernel functions are typed by the kernel compiler)

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import pytest
import taichi as ti

from tests.sim import scenes
from tests.sim.test_adjoint import Probe
from zoobench.arrays import Array
from zoobench.sim.kernels.laws.law import Law, linear_kappa
from zoobench.sim.kernels.symmetric import cofactors, invariants, trace_of, unit
from zoobench.sim.model.laws.medium import SolidMedium
from zoobench.sim.model.rollout import Gradient
from zoobench.sim.model.scene import Effect, MediumBed, Scene
from zoobench.sim.solver import Solver


@dataclass(frozen=True)
class Gel(SolidMedium):
    """A Kelvin-Voigt solid: mu (b - I) + lambda/2 (det(b) - 1) I, and the viscous stress 2 eta dev(D).

    Attributes:
        viscosity: eta [Pa s].
    """

    viscosity: float

    name = "gel"
    kernels = __name__
    constants = ("mu", "lam", "viscosity")
    colour = (0.6, 0.9, 0.7)
    flows = True

    @property
    def kappa(self) -> float:
        """2 mu + 3 lambda [Pa]."""
        return 2.0 * self.mu + 3.0 * self.lam

    @property
    def largest_shear(self) -> float:
        """None."""
        return float("inf")

    def rest_history(self, strain: Array) -> Array:
        """It has none."""
        return np.zeros(strain.shape[:-1])

    def returned(self, strain: Array, history: Array) -> tuple[Array, Array]:
        """It never yields."""
        return strain, history

    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """Principal values of the elastic part."""
        volume = 2.0 * strain.sum(-1, keepdims=True)
        return cast(Array, self.mu * np.expm1(2.0 * strain) + 0.5 * self.lam * np.expm1(volume))

    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """Its integral by the strain."""
        volume = 2.0 * strain.sum(-1)
        shear = (np.expm1(2.0 * strain) - 2.0 * strain).sum(-1)
        return cast(Array, 0.5 * self.mu * shear + 0.25 * self.lam * (np.expm1(volume) - volume))


@ti.func
def gel_update(trial, history, medium: ti.template(), law: ti.template()):
    """The trial b stays."""
    E = trial - unit()
    inv = invariants(E)
    growth = inv[0] + inv[1] + inv[2]  # det(b) - 1
    return trial, history, medium.mu * E + (0.5 * medium.lam * growth) * unit()


@ti.func
def gel_update_adjoint(
    trial, history, b_adjoint, after_adjoint, tau_adjoint, medium: ti.template(), law: ti.template()
):
    """Adjoint of `gel_update`."""
    by_growth = 0.5 * medium.lam * trace_of(tau_adjoint)
    return b_adjoint + medium.mu * tau_adjoint + by_growth * cofactors(trial), after_adjoint


LAW = Law(Gel.constants, linear_kappa, gel_update, gel_update_adjoint, is_viscous=True)

GEL = Gel(2e4, 0.3, 1000.0, viscosity=5.0)


def _scene(friction: float | None = 0.3) -> Scene:
    """The muscle cube on a bed of gel."""
    scene = scenes.medium_scene("sand")
    assert scene.medium is not None
    bed = MediumBed.at_rest(GEL, scene.medium.positions, scene.medium.volumes)
    return replace(scene, medium=replace(bed, friction=friction))


def test_a_scene_with_a_new_law_has_its_effects() -> None:
    """They follow from what the law says of itself."""
    assert _scene().effects >= {Effect.FLUID, Effect.CONTACT}
    assert Effect.PLASTICITY not in _scene().effects


def test_the_stress_of_a_new_law_is_that_of_its_twin() -> None:
    """Of a column that was pressed together, after a step in which it hardly moves."""
    strains = np.tile([0.0, -0.01, 0.0], (len(scenes.medium_bed().positions), 1))
    scene = _scene()
    assert scene.medium is not None
    bed = MediumBed.at_rest(GEL, scene.medium.positions, scene.medium.volumes, strains)
    solver = Solver(replace(scene, medium=bed), scenes.fidelity())
    solver.substeps(1, 1e-9)
    expected = GEL.stress(strains)
    assert solver.matter.tau[0, 0, :, :3].numpy() == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow  # the package's own laws go the same way
@pytest.mark.parametrize("name", scenes.GROUPS)
def test_the_gradient_of_a_new_law_matches_central_differences(name: str, probe: tuple[Probe, Gradient]) -> None:
    """Of an episode on it, by every group of parameters."""
    probed, gradient = probe
    direction = np.random.default_rng(7).normal(size=probed.base[name].shape)
    assert probed.error(gradient, name, direction, 1e-5) <= 1e-4


@pytest.fixture(scope="module")
def probe() -> tuple[Probe, Gradient]:
    """A random functional of an episode on gel, and its gradient."""
    probed = Probe(_scene(), 8)
    return probed, probed.gradient()


def test_gel_damps_what_moves_in_it() -> None:
    """Without gravity, a sheared bed comes to rest sooner with more viscosity."""
    left = []
    for viscosity in (0.01, 100.0):
        scene = replace(_scene(), gravity=scenes.NO_GRAVITY)
        assert scene.medium is not None
        velocities = np.zeros_like(scene.medium.positions)
        velocities[:, 2] = 0.1 * np.sin(30.0 * scene.medium.positions[:, 0])
        bed = replace(
            scene.medium,
            material=replace(GEL, viscosity=viscosity),
            velocities=velocities,
        )
        solver = Solver(replace(scene, medium=bed), scenes.fidelity())
        solver.run(np.zeros((8, 1, solver.muscle_count)))
        left.append(float(solver.matter.v[0, 0, solver.robot_count :].square().sum()))
    assert left[1] < 0.5 * left[0]
