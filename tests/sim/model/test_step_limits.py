"""The step: its formula, the whole number of substeps and the steps that are refused."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import StepSizeError
from zoobench.sim.model.elastic_bodies import ElasticBody, SceneObject
from zoobench.sim.model.fidelity import Fidelity, Kernel, Transfer
from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.sim.model.laws.snow import SMALLEST_PLASTIC, SnowMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.step_limits import (
    LARGEST_STRETCH,
    Condition,
    choose_step,
    elastic_kappa,
    isolated_particle_limit,
    step_limits,
    step_now,
)
from zoobench.sim.solver import Solver


def test_limit_is_that_of_the_isolated_particle() -> None:
    """dt_iso = h sqrt(rho / kappa), with kappa = 2 (k mu + s) stretch^2 + 3 k lambda, and 2 mu + 3 lambda of sand."""
    assert isolated_particle_limit(Fidelity(0.1), 0.25) == pytest.approx(0.2)
    assert isolated_particle_limit(Fidelity(0.1), 0.0) == np.inf
    assert elastic_kappa(3.0, 5.0, 2.0, 7.0, 1.5) == pytest.approx(2 * (6 + 7) * 2.25 + 30)
    scene = scenes.medium_scene()
    limits = step_limits(scene, scenes.fidelity(), 1.0, 1.0)
    mu, lam = lame_parameters(1e4, 0.2)
    kappa = 2 * (mu + 3000) * LARGEST_STRETCH**2 + 3 * lam
    lightest = 1000 * scene.robot.density_ratio.min()
    assert limits["robot"] == pytest.approx(scenes.SPACING * np.sqrt(lightest / kappa))
    mu, lam = lame_parameters(1e5, 0.2)
    assert limits["sand"] == pytest.approx(scenes.SPACING * np.sqrt(1600 / (2 * mu + 3 * lam)))


@pytest.mark.parametrize("name", ["ball", "ground"])
def test_the_lightest_body_decides_the_step_on_the_ground(name: str) -> None:
    """An object's density counts, whatever it is called."""
    scene = scenes.ground_scene()
    body = scenes.passive_block((0.5, 0.0, 0.5), (2, 2, 2), np.zeros(3))
    light = replace(body, material=replace(body.material, density=5.0, youngs_modulus=1e3))
    alone = step_limits(scene, scenes.fidelity(), 1.0, 1.0)["ground"]
    found = step_limits(replace(scene, objects=(SceneObject(name, light),)), scenes.fidelity(), 1.0, 1.0)
    assert found["ground"] == pytest.approx(alone * np.sqrt(5.0 / (1000.0 * scene.robot.density_ratio.min())))


@pytest.mark.parametrize("setting", [{"kernel": "cubic"}, {"transfer": "pic"}, {"medium_transfer": "pic"}])
def test_step_in_the_rest_frame_depends_on_no_spline_and_no_transfer(setting: dict[str, str]) -> None:
    """A grid that the robot carries with it has neither."""
    fidelity = Fidelity(0.1, robot="lagrangian")
    other = replace(fidelity, **setting)  # type: ignore[arg-type]
    assert isolated_particle_limit(other, 0.25, 0.1) == isolated_particle_limit(fidelity, 0.25, 0.1)


@pytest.mark.parametrize("name", scenes.MEDIA)
def test_stiffness_of_a_medium_is_that_of_its_law(name: str) -> None:
    """kappa is the derivative of the stress by an equal strain in all directions, at the stiffest intended state."""
    material, at, plastic = scenes.MEDIA[name], -1e-6, 1.0
    if isinstance(material, SnowMaterial):
        at, plastic = np.log(1 + material.critical_stretch), SMALLEST_PLASTIC
    if isinstance(material, WaterMaterial):
        at = np.log(0.9) / 3
    e = 1e-7
    plus, minus = (material.stress(np.full(3, at + s * e), plastic)[0] for s in (1, -1))
    assert material.kappa == pytest.approx((plus - minus) / (2 * e), rel=1e-5)
    scene = scenes.medium_scene(name)
    dt = step_limits(scene, scenes.fidelity(), 1.0, 1.0)[name]
    viscosity = getattr(material, "viscosity", 0.0)
    scale = 4.0 / (material.density * scenes.SPACING**2)
    # the root of the damped oscillator's limit: omega^2 dt^2 + 2 x = 4 with x = scale 2 eta dt
    assert scale * material.kappa * dt**2 + 4.0 * scale * viscosity * dt == pytest.approx(4.0, rel=1e-12)


def test_bounds_of_the_design_count_not_only_its_present_state() -> None:
    """A design that may become stiffer or lighter gets the step of its extreme, one that is so already as well."""
    scene = scenes.flight_scene()
    here = step_limits(scene, scenes.fidelity(), 0.1, 9.0)["robot"]
    assert step_limits(scene, scenes.fidelity(), 4.0, 9.0)["robot"] < here
    assert step_limits(scene, scenes.fidelity(), 0.1, 0.01)["robot"] < here
    stiffer = replace(scene.robot, stiffness=scene.robot.stiffness * 2)
    assert step_limits(replace(scene, robot=stiffer), scenes.fidelity(), 0.1, 9.0)["robot"] < here


@pytest.mark.parametrize("courant", [0.1, 0.37, 0.5, 0.9])
def test_frame_is_a_whole_number_of_substeps(courant: float) -> None:
    """The step divides the frame, is at most the requested one, and with one substep less it would not be."""
    limit = choose_step(scenes.medium_scene(), scenes.fidelity(courant=courant), 0.008)
    n = limit.substeps_per_frame
    assert limit.dt * n == pytest.approx(0.008, rel=1e-14)
    assert limit.fraction <= courant * (1 + 1e-9)
    assert n == 1 or 0.008 / (n - 1) > courant * limit.dt_iso
    assert limit.matter == "sand"


def test_exact_divisor_is_taken_as_it_is() -> None:
    """A frame of exactly three steps gets three, not four by round-off."""
    scene = scenes.flight_scene()
    dt_iso = step_limits(scene, scenes.fidelity(), 1.0, 1.0)["robot"]
    assert choose_step(scene, scenes.fidelity(courant=0.3), 3 * 0.3 * dt_iso).substeps_per_frame == 3


def test_unsafe_fixed_step_is_refused() -> None:
    """Above 0.9 dt_iso, with the limit, the matter that sets it and a step that is safe; below it is taken."""
    scene = scenes.medium_scene()
    with pytest.raises(
        StepSizeError, match=r"0\.004 s .* 1\.31 of .* sand sets the limit: dt_iso = 0\.00306 s.* 0\.0015 s"
    ):
        Solver(scene, replace(scenes.fidelity(), step=0.004))
    solver = Solver(scene, replace(scenes.fidelity(), step=0.0021))
    rollout = solver.run(scenes.actuation(solver, 3))
    assert (rollout.counts == 4).all()
    assert solver.dt == pytest.approx(0.002)


def _spinning_particle(
    courant: float, transfer: Transfer = "apic", kernel: Kernel = "quadratic", viscosity: float = 0.0
) -> tuple[Solver, float]:
    """A single particle set off by a velocity gradient, and the norm of that."""
    rate = np.array([[6.0, 2.0, 0.0], [2.0, -5.0, 1.0], [0.0, 1.0, 3.0]])
    material = replace(scenes.STIFF, viscosity=viscosity)
    body = ElasticBody.passive(material, np.array([[0.376, 0.371, 0.383]]), np.array([scenes.SPACING**3 / 8]))
    scene = Scene(replace(body, velocity_gradients=rate[None]), (0.0, 0.0, 0.0), scenes.ARENA, gravity=(0.0, 0.0, 0.0))
    fidelity = scenes.fidelity(courant=courant, transfer=transfer, kernel=kernel)
    return Solver(scene, fidelity), float(np.linalg.norm(rate))


def test_matter_that_no_step_suits_is_refused() -> None:
    """In words, without a fixed step that nobody asked for."""
    scene = scenes.medium_scene()
    hard = replace(scene, robot=replace(scene.robot, stiffness=scene.robot.stiffness * 1e40))
    with pytest.raises(StepSizeError, match=r"The robot needs steps of \S+ s, and 8e-07 s are the shortest"):
        choose_step(hard, scenes.fidelity(), 0.01, stiffness_max=1e40)


def test_a_long_frame_may_have_any_number_of_steps() -> None:
    """Validation's rigs take the whole time of a case as a frame: what counts is how short a step is."""
    assert choose_step(scenes.medium_scene(), scenes.fidelity(), 100.0).substeps_per_frame > 10_000


def test_isolated_particle_stays_bounded_near_the_limit() -> None:
    """It swings for 5,000 substeps at 0.9 of its own dt_iso without growing."""
    solver, rate = _spinning_particle(0.9)
    solver.reset()
    dt_iso = solver.current_limit()[0].dt_iso
    largest = []
    for _ in range(50):
        solver.substeps(100, 0.9 * dt_iso)
        largest.append(float((solver.matter.F[0, 0, 0] - solver.simulation.tensor(np.eye(3))).norm()))
    # symplectic Euler swings at omega = 2 / dt_iso with the amplitude of its first speed over sqrt(1 - 0.9^2)
    assert 0 < max(largest) < 1.02 * rate * dt_iso / 2 / np.sqrt(1 - 0.9**2)


def test_isolated_particle_beyond_the_limit_grows() -> None:
    """The predicted limit is sharp: five per cent above it the same particle blows up."""
    solver, _ = _spinning_particle(0.9)
    solver.reset()
    solver.substeps(500, 1.05 * solver.current_limit()[0].dt_iso)
    F = solver.matter.F[0, 0, 0]
    assert not float((F - solver.simulation.tensor(np.eye(3))).norm()) < 1.0


def test_limit_by_kernel_and_transfer() -> None:
    """2 / sqrt(3) of the quadratic spline's with the cubic one, 1 / sqrt(2) of it with PIC, as it is with AFLIP."""
    limits = {
        (transfer, kernel): isolated_particle_limit(scenes.fidelity(transfer=transfer, kernel=kernel), 0.25)
        for transfer in get_args(Transfer)
        for kernel in get_args(Kernel)
    }
    usual = limits["apic", "quadratic"]
    for (transfer, kernel), limit in limits.items():
        wide = 2.0 / np.sqrt(3.0) if kernel == "cubic" else 1.0
        assert limit == pytest.approx(usual * wide * (np.sqrt(0.5) if transfer == "pic" else 1.0), rel=1e-14)


@pytest.mark.parametrize("viscosity", [0.0, 40.0])
@pytest.mark.parametrize(
    ("transfer", "kernel"),
    [
        # each compiles kernels of its own
        pytest.param(transfer, kernel, marks=() if (transfer, kernel) == ("apic", "quadratic") else pytest.mark.slow)
        for transfer in get_args(Transfer)
        for kernel in get_args(Kernel)
    ],
)
def test_limit_is_sharp(transfer: Transfer, kernel: Kernel, viscosity: float) -> None:
    """A particle stretched by a little stays bounded two per cent below its limit and grows two per cent above it."""
    solver, _ = _spinning_particle(0.5, transfer, kernel, viscosity)
    stretch = 1e-6 * np.array([[6.0, 2.0, 0.0], [2.0, -5.0, 1.0], [0.0, 1.0, 3.0]])
    growth = []
    for share in (0.98, 1.02):
        solver.reset()
        solver.matter.C.zero_()
        solver.matter.F[0, 0, 0] += solver.simulation.tensor(stretch)
        solver.substeps(400, share * solver.current_limit()[0].dt_iso)
        found = solver.matter.F[0, 0, 0].numpy() - np.eye(3)
        growth.append(float(np.linalg.norm(found) / np.linalg.norm(stretch)))
    assert growth[0] <= 6.0  # symplectic Euler swings by 1 / sqrt(1 - 0.98^2) as far
    assert not growth[1] < 1e2


@pytest.mark.parametrize("courant", [0.7, 0.25])
@pytest.mark.parametrize(("bound", "quantity"), [("speed", "speed"), ("velocity gradient", "shear")])
def test_a_fast_state_takes_steps_below_what_is_refused(bound: str, quantity: str, courant: float) -> None:
    """Of 0.4 cells, and of a velocity gradient times dt of 0.4: a fifth below the half that the survey refuses."""
    scene = scenes.flight_scene()
    calm = Condition(**dict.fromkeys(Condition._fields, 0.0) | {"smallest_j": 1.0, "stretch": 1.0})
    rate = 500.0  # cells a second, or 1/s
    value = rate * scenes.SPACING if bound == "speed" else rate
    limit = step_now(scene, scenes.fidelity(courant=courant), 0.008, calm._replace(**{quantity: value}))
    assert limit.matter == bound
    assert courant * limit.dt_iso * rate == pytest.approx(0.4)
    assert limit.substeps_per_frame == 10
    assert limit.dt == pytest.approx(0.0008)
