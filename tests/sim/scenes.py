"""Small scenes that the tests of the simulator share: a few hundred particles each."""

from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import BodyParticles, ElasticBody
from zoobench.sim.model.fidelity import Fidelity, Kernel, Transfer
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.laws.snow import SnowMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.model.scene import Effect, Ground, MediumBed, Scene
from zoobench.sim.model.step_limits import choose_step
from zoobench.sim.solver import BodyState, Solver

SPACING = 1 / 32
EDGE = SPACING / 2
"""Of the cubes that particles stand for, eight in a cell [m]."""
ARENA = (0.75, 0.75, 0.75)
NO_GRAVITY = (0.0, 0.0, 0.0)
SOFT = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=3000.0)
STIFF = ElasticMaterial(youngs_modulus=1e6, poissons_ratio=0.2, density=1000.0)
SAND = SandMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1600.0, friction_angle=45.0)
SNOW = SnowMaterial(
    youngs_modulus=1.4e5,
    poissons_ratio=0.2,
    density=400.0,
    critical_compression=2.5e-2,
    critical_stretch=7.5e-3,
    hardening=10.0,
)
MEDIA: dict[str, Medium] = {
    "sand": SAND,
    "clay": ClayMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1800.0, yield_stress=200.0),
    "mud": MudMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1400.0, yield_stress=100.0, viscosity=1.0),
    "snow": SNOW,
    "water": WaterMaterial(bulk_modulus=1e5, density=1000.0, viscosity=0.1),
}
MUSCLES = 3
BODY_GROUPS = ("stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres")
GROUPS = ("actuation", *BODY_GROUPS)
COMBINATIONS: list[tuple[Transfer, Kernel]] = [(t, k) for t in get_args(Transfer) for k in get_args(Kernel)]
"""Every transfer with every kernel, the default first."""


def fidelity(
    precision: int = 64,
    courant: float = 0.5,
    transfer: Transfer = "apic",
    kernel: Kernel = "quadratic",
    medium_transfer: Transfer = "apic",
) -> Fidelity:
    """The grid of all small scenes, of which nothing sleeps: see `test_sleep`."""
    bits: Literal[32, 64] = 64 if precision == 64 else 32
    transfers = {"transfer": transfer, "medium_transfer": medium_transfer}
    return Fidelity(SPACING, courant=courant, precision=bits, kernel=kernel, sleep=0.0, **transfers)


def steady(
    scene: Scene, precision: int = 64, courant: float = 0.5, frame_seconds: float = 0.008, **bounds: float
) -> Fidelity:
    """The same grid with the scene's declared step held fixed: no step is chosen and no frame repeated."""
    limit = choose_step(scene, fidelity(precision, courant), frame_seconds, **bounds)
    return replace(fidelity(precision, courant), step=limit.dt)


def muscle_body(
    lower: tuple[float, float, float] = (0.3, 0.3, 0.3), cells: int = 3, moving: bool = False, seed: int = 1
) -> ElasticBody:
    """A cube with muscles of random soft shares and fibres; stiffness and occupancy vary inside their bounds."""
    rng = np.random.default_rng(seed)
    corner = np.array(lower)
    positions = fill_box(corner, corner + cells * SPACING, SPACING, 8)
    count = len(positions)
    fibres = rng.normal(size=(count, 3))
    velocities = np.zeros((count, 3))
    if moving:
        velocities += [0.3, -0.5, 0.1] + (positions - positions.mean(0)) @ rng.normal(size=(3, 3))
    return ElasticBody(
        material=SOFT,
        positions=positions,
        volumes=np.full(count, particle_volume(SPACING, 8)),
        stiffness=rng.uniform(0.5, 0.9, count),
        density_ratio=rng.uniform(0.6, 1.0, count),
        occupancy=rng.uniform(0.4, 0.9, count),
        muscle_membership=rng.dirichlet(np.ones(MUSCLES), count),
        fibres=fibres / np.linalg.norm(fibres, axis=1, keepdims=True),
        velocities=velocities,
    )


def medium_bed(name: str = "sand", depth: int = 2, first: int = 8, cells: int = 7) -> MediumBed:
    """A square bed of a medium on the ground, free at its sides."""
    lower = np.array([first * SPACING, 0.0, first * SPACING])
    upper = lower + SPACING * np.array([cells, depth, cells])
    positions = fill_box(lower, upper, SPACING, 8)
    count = len(positions)
    return MediumBed.at_rest(MEDIA[name], positions, np.full(count, particle_volume(SPACING, 8)))


def weightless(body: ElasticBody) -> Scene:
    """A body in free flight, without gravity and contact."""
    return Scene(body, (0.0, 0.0, 0.0), ARENA, gravity=NO_GRAVITY)


def pair_scene(approach: float, aside: float = 0.0) -> Scene:
    """Two cubes of three cells with muscles as one body in free flight, two cells from each other, which they approach
    along x, and pass by along y [m/s]."""
    one, other = muscle_body((0.1, 0.3, 0.3)), muscle_body((0.1, 0.3, 0.3), seed=5)
    arrays = {
        item.name: np.concatenate([getattr(one, item.name), getattr(other, item.name)])
        for item in fields(BodyParticles) if isinstance(getattr(one, item.name), np.ndarray)
    }  # fmt: skip
    count = one.particle_count
    arrays["positions"][count:] += (5 * SPACING, 0.0, 0.0)
    velocities = np.zeros((2 * count, 3))
    velocities[:count, 0], velocities[count:, :2] = approach / 2, (-approach / 2, aside)
    body = replace(one, material=replace(SOFT, viscosity=20.0), **arrays, velocities=velocities)
    return weightless(body)


def flight_scene(moving: bool = True) -> Scene:
    """The muscle cube in free flight."""
    return weightless(muscle_body(moving=moving))


def ground_scene(friction: float = 0.5, moving: bool = True) -> Scene:
    """The muscle cube on the ground, pushed along."""
    body = muscle_body((0.3, 0.0, 0.3), moving=moving)
    return Scene(body, (0.0, 0.0, 0.0), ARENA, ground=Ground(friction), gravity=(0.5, -9.81, 0.2))


def medium_scene(name: str = "sand") -> Scene:
    """The muscle cube landing on a bed of a medium."""
    body = muscle_body((0.3, 2 * SPACING, 0.3), moving=True)
    return Scene(body, (0.0, 0.0, 0.0), ARENA, ground=Ground(0.5), medium=medium_bed(name), gravity=(0.5, -9.81, 0.2))


def interface_scene() -> Scene:
    """The muscle cube pressed a little into sand, which it meets in a velocity field of its own."""
    return _immersed_scene("sand", 0.1, friction=0.3)


def mire_scene() -> Scene:
    """The same with mud, which slides on the ground."""
    return _immersed_scene("mud", 0.1, friction=0.3)


def wading_scene() -> Scene:
    """The muscle cube in water near the ground, which it meets in a velocity field of its own."""
    return _immersed_scene("water", 1.9, friction=0.0, transfer="aflip")


def _immersed_scene(name: str, depth: float, **bed: Any) -> Scene:
    """The muscle cube at a depth in a medium [cells], with these attributes of its bed."""
    scene = medium_scene(name)
    assert scene.medium is not None
    sunk = replace(scene.robot, positions=scene.robot.positions - np.array([0.0, depth * SPACING, 0.0]))
    return replace(scene, robot=sunk, medium=replace(scene.medium, **bed))


def damped_scene() -> Scene:
    """The muscle cube on the ground, of viscous matter."""
    scene = ground_scene()
    return replace(scene, robot=replace(scene.robot, material=replace(SOFT, viscosity=20.0)))


SCENES: dict[str, Callable[[], Scene]] = {
    "flight": flight_scene,
    "ground": ground_scene,
    "damped": damped_scene,
    "interface": interface_scene,
    "mire": mire_scene,
    "wading": wading_scene,
} | {name: partial(medium_scene, name) for name in MEDIA}


def passive_block(lower: tuple[float, float, float], cells: tuple[int, int, int], velocity: Array) -> ElasticBody:
    """A stiff block without muscles that moves as one."""
    corner = np.array(lower)
    positions = fill_box(corner, corner + SPACING * np.array(cells), SPACING, 8)
    body = ElasticBody.passive(STIFF, positions, np.full(len(positions), particle_volume(SPACING, 8)))
    return replace(body, velocities=body.velocities + velocity)


def with_idle_muscle(body: ElasticBody) -> ElasticBody:
    """A passive body of soft matter with a muscle at rest along x, so that its kernels are those of the muscle cube."""
    count = body.particle_count
    fibres = np.tile([1.0, 0.0, 0.0], (count, 1))
    return replace(body, material=SOFT, muscle_membership=np.ones((count, 1)), fibres=fibres)


def thrown_body(velocity: Array | None = None, gradient: Array | None = None, cells: int = 3) -> ElasticBody:
    """The muscle cube in the velocity field `velocity + gradient (x - centre)`, its APIC matrix set to match."""
    middle = 0.375 - cells * SPACING / 2
    body = muscle_body((middle, middle, middle), cells)
    base = np.zeros(3) if velocity is None else velocity
    if gradient is None:
        return replace(body, velocities=body.velocities + base)
    centre = body.positions.mean(0)
    return replace(
        body,
        velocities=base + (body.positions - centre) @ gradient.T,
        velocity_gradients=np.tile(gradient, (body.particle_count, 1, 1)),
    )


def actuation(solver: Solver, frames: int, seed: int = 2) -> Array:
    """Random actuation `[frames, worlds, muscles]` inside its bounds."""
    shape = (frames, solver.worlds, solver.muscle_count)
    return np.random.default_rng(seed).uniform(-0.9, 0.9, shape)


def path_weights(solver: Solver, frames: int, seed: int = 3) -> tuple[Array, Array]:
    """Random adjoints of the trajectory: of positions and velocities."""
    rng = np.random.default_rng(seed)
    shape = (frames + 1, solver.worlds, solver.simulation.elastic_count, 3)
    return rng.normal(size=shape), 0.1 * rng.normal(size=shape)


def episode(
    scene: Scene, frames: int, given: Fidelity | None = None, body: BodyState | None = None, **options: Any
) -> tuple[Solver, Rollout, Gradient]:
    """Random actuation and the gradient for random adjoints of the trajectory, by a solver with these options."""
    solver = Solver(scene, given or fidelity(), gradients=True, **options)
    rollout = solver.run(actuation(solver, frames), body)
    return solver, rollout, solver.backward(rollout, *path_weights(solver, frames))


def node_momenta(solver: Solver) -> tuple[Array, Array]:
    """Linear and angular momentum of a robot in its rest frame, from the masses that the last launch left behind."""
    nodes = solver.matter.nodes[0, 0].numpy()
    inverse = solver.launcher._inverse[0].numpy()  # type: ignore[attr-defined]
    mass = np.divide(1.0, inverse, out=np.zeros_like(inverse), where=inverse > 0)
    x, v = nodes[:, 0, :3], nodes[:, 1, :3]
    return mass @ v, mass @ np.cross(x, v)


def compare_with_differences(scene: Scene, frames: int, given: Fidelity) -> Rollout:
    """The rollout whose gradient agrees with differences, of every group of parameters along a random direction, for
    random adjoints of the trajectory."""
    solver, rollout, gradient = episode(scene, frames, given, density_ratio_min=0.5)
    assert not rollout.divergences
    weights, acts = path_weights(solver, frames), actuation(solver, frames)
    base = BodyState().filled(scene, 1)

    def loss(name: str, change: Array) -> float:
        body = base if name == "actuation" else base | {name: base[name] + change}
        found = solver.run(acts + change if name == "actuation" else acts, BodyState(**body), replay=rollout)
        return float((found.positions * weights[0]).sum() + (found.velocities * weights[1]).sum())

    rng, step = np.random.default_rng(5), 2e-6
    for name in GROUPS:
        exact = getattr(gradient, name)
        direction = rng.normal(size=exact.shape)
        along = float((exact * direction).sum())
        found = (loss(name, step * direction) - loss(name, -step * direction)) / (2 * step)
        assert abs(found - along) <= max(2e-5 * abs(along), 1e-6 * np.abs(exact * direction).sum()), name
    return rollout


def same(one: Gradient, other: Gradient, names: tuple[str, ...] = GROUPS) -> bool:
    """Whether two gradients agree bit for bit in these parameter groups."""
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def compare_drivers(scene: Scene, frames: int, given: Fidelity | None = None) -> tuple[Rollout, Rollout]:
    """Rollouts of two worlds by the serial and the parallel driver: trajectory and gradient agree to 1e-12."""
    (_, serial, gradient), (_, parallel, other) = (
        episode(scene, frames, given, worlds=2, parallel=parallel) for parallel in (False, True)
    )
    assert np.abs(parallel.positions - serial.positions).max() <= 1e-12
    for group in GROUPS:
        expected = getattr(gradient, group)
        assert np.abs(getattr(other, group) - expected).max() <= 1e-12 * np.abs(expected).max(), group
    return serial, parallel


def with_corner_at(scene: Scene, corner: Array) -> Scene:
    """The scene with the robot's lowest corner at a place [cells]."""
    moved = corner * SPACING - scene.robot.positions.min(0)
    return replace(scene, robot=replace(scene.robot, positions=scene.robot.positions + moved))


def compare_precisions(scene: Scene) -> None:
    """Gradients in single precision are those in double to 1e-3 of the largest."""
    single, double = (episode(scene, 2, fidelity(bits))[2] for bits in (32, 64))
    for group in GROUPS:
        exact = getattr(double, group)
        assert np.abs(getattr(single, group) - exact).max() <= 1e-3 * np.abs(exact).max(), group


def momenta(solver: Solver) -> tuple[Array, Array]:
    """Linear and angular momentum, that of the affine motion included."""
    mass, matter = solver.parameters.mass[0].numpy(), solver.matter
    x, v, C = (tensor[0, 0].numpy() for tensor in (matter.x, matter.v, matter.C))
    axial = np.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], axis=1)
    return mass @ v, mass @ (np.cross(x, v) + solver.fidelity.moment * axial)


def thrown(solver: Solver, velocity: Array, frames: int) -> Array:
    """The exact discrete solution v n dt - g dt^2 n (n + 1) / 2 of free fall with a fixed step `[frames + 1, 3]`."""
    steps = np.arange(frames + 1) * solver.substeps_per_frame
    moved: Array = velocity * (steps * solver.dt)[:, None]
    moved[:, 1] -= 9.81 * solver.dt**2 * steps * (steps + 1) / 2
    return moved


def launched(scene: Scene) -> set[str]:
    """What is launched for a scene: its effects, and the decomposition that plasticity needs."""
    return {*scene.effects, *(["decomposition"] if Effect.PLASTICITY in scene.effects else [])}
