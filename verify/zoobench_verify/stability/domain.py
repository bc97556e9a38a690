"""The arena: corners, walls, grid nodes, and the distance from the origin."""

from dataclasses import replace

import numpy as np

from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.solver import Solver
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import GROWTH, EnergyHistory, EpisodeRecorder, case

_SIDE = 0.75


def _escape(energies: EnergyHistory, scene: Scene) -> float:
    """Largest distance of matter beyond a wall plane [cells]."""
    below = energies.largest(lambda balance: float((np.array(scene.lower) - balance.lowest).max()))
    above = energies.largest(lambda balance: float((balance.highest - np.array(scene.upper)).max()))
    return max(below, above) / scenes.SPACING


@case("all-corners")
def all_corners(record: EpisodeRecorder) -> None:
    """A cube is thrown at 3 m/s into each of the eight corners, and rebounds from all walls."""
    positions = scenes.cube()
    found = []
    for signs in 2.0 * np.indices((2, 2, 2)).reshape(3, -1).T - 1.0:
        body = scenes.passive(positions, velocity=3.0 * signs)
        scene = scenes.flight(body, _SIDE)
        rollout, energies = record.episode(Solver(scene, scenes.fidelity()), 40)
        returned = float((-signs * rollout.velocities[-1, 0].mean(0)).min())
        found.append((_escape(energies, scene), energies.growth, float(rollout.smallest_j.min()), returned))
    escape, growth, smallest, back = np.array(found).T
    # a particle's stencil reaches two of the constrained nodes
    record.at_most("beyond a wall [cells]", escape.max(), WALL_NODES - 2.0)
    record.at_most("energy / initial", growth.max(), GROWTH)
    record.at_least("smallest J", smallest.min(), 0.05)
    record.at_least("speed of return along each axis [m/s]", back.min(), 0.3)


@case("launched-at-the-edge")
def launched_at_the_edge(record: EpisodeRecorder) -> None:
    """A cube that touches a wall moves into it at 8 m/s; a cube that starts beyond it is refused."""
    for axis in range(3):
        x, y, z = np.where(np.arange(3) == axis, _SIDE - 4 * scenes.SPACING, scenes.MIDDLE)
        scene = scenes.flight(scenes.passive(scenes.cube((x, y, z)), velocity=8.0 * np.eye(3)[axis]), _SIDE)
        _, energies = record.episode(Solver(scene, scenes.fidelity()), 20)
        record.at_most(f"axis {axis}: beyond the wall [cells]", _escape(energies, scene), 1.0)
        record.energy_bounded(energies, f"axis {axis}: ")
    outside = scenes.lattice((_SIDE - scenes.SPACING, 0.3, 0.3), (2, 2, 2))
    record.refuses(
        "a body across the wall", "lie outside the arena", lambda: scenes.flight(scenes.passive(outside), _SIDE)
    )


@case("on-the-nodes")
def on_the_nodes(record: EpisodeRecorder) -> None:
    """Isolated particles on nodes, cell borders and wall planes move with a common velocity and keep their volume."""
    offsets = np.array([0.0, 0.5, 1.0 - 1e-7, 1e-7])
    cells = np.indices((4, 4, 4)).reshape(3, -1).T
    positions = scenes.SPACING * (5.0 * cells + 3.0 + offsets[cells])
    side = 5.0 * 4 * scenes.SPACING
    at_walls = np.array([[0.0, 0.0, 0.0], [side, side, side], [0.0, side, 0.3]])
    velocity = np.array([0.3, -0.2, 0.1])
    for precision, tolerance in ((64, 1e-12), (32, 1e-6)):
        body = scenes.passive(positions, velocity=velocity)
        solver = Solver(scenes.flight(body, side), scenes.fidelity(precision))
        solver.reset()
        energies = record.march(solver, 20, solver.dt, every=1)
        mass = float(solver.parameters.mass.sum())
        drift = max(float(np.abs(balance.momentum / mass - velocity).max()) for balance in energies.balances)
        record.at_most(
            f"{precision} bits: change of velocity / speed", drift / float(np.linalg.norm(velocity)), tolerance
        )
        record.at_most(f"{precision} bits: |J - 1|", abs(energies.smallest_j - 1.0), 1e2 * tolerance)
        way = (solver.positions(0) - positions).mean(0) / (20 * solver.dt * velocity)
        record.at_most(f"{precision} bits: |way / (velocity x time) - 1|", np.abs(way - 1.0).max(), 1e-3)
    solver = Solver(scenes.flight(scenes.passive(at_walls), side), scenes.fidelity())
    rollout, _ = record.episode(solver, 20)
    moved = float(np.abs(rollout.positions[-1] - rollout.positions[0]).max())
    record.at_most("moved at rest on the wall planes [m]", moved, 0.0)


def _tumbling(shift: float) -> Scene:
    """A cube that falls on rough ground and tumbles, `shift` [m] away from the origin along x and z."""
    body = scenes.passive(scenes.cube((0.3125, 0.0625, 0.3125)), scenes.MUSCLE)
    away = np.array([shift, 0.0, shift])
    body = replace(body, positions=body.positions + away, velocities=body.velocities + np.array([1.5, -1.0, 0.4]))
    lower = (shift, 0.0, shift)
    return Scene(body, lower, (shift + 1.5, _SIDE, shift + 1.5), ground=Ground(0.5))


@case("far-from-origin")
def far_from_origin(record: EpisodeRecorder) -> None:
    """The same tumbling cube 0, 1, 10 and 100 m from the origin, in 32 bits: positions are relative to the arena."""
    paths = []
    for shift in (0.0, 1.0, 10.0, 100.0):
        solver = Solver(_tumbling(shift), scenes.fidelity())
        _, energies = record.episode(solver, 60)
        record.energy_bounded(energies, f"{shift:g} m: ")
        paths.append(solver.matter.x[0, 0].numpy().copy())
    for shift, path in zip((1.0, 10.0, 100.0), paths[1:], strict=True):
        record.at_most(f"{shift:g} m: largest difference of places [m]", np.abs(path - paths[0]).max(), 0.0)


@case("off-the-lattice")
def off_the_lattice(record: EpisodeRecorder) -> None:
    """The tumbling cube shifted by fractions of a cell along the ground: its final position hardly depends on it."""
    ends = []
    for fraction in (0.0, 0.25, 0.5):
        scene = _tumbling(0.0)
        away = np.array([1.0, 0.0, 1.0]) * fraction * scenes.SPACING
        scene = replace(scene, robot=replace(scene.robot, positions=scene.robot.positions + away))
        rollout, energies = record.episode(Solver(scene, scenes.fidelity()), 40)
        record.energy_bounded(energies, f"{fraction:g}: ")
        ends.append(rollout.positions[-1, 0].mean(0) - away)
    spread = float(np.abs(np.array(ends) - ends[0]).max()) / scenes.SPACING
    record.at_most("spread of the centre's end [cells]", spread, 1.0)
