"""The arena: its corners and walls, its edge, its nodes, and its distance from the origin."""

from dataclasses import replace

import numpy as np

from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.model.scene import Ground, Scene
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import GROWTH, Ledger, episode, healthy, march

_SIDE = 0.75


def _escape(ledger: Ledger, scene: Scene) -> float:
    """How far matter ever lay beyond a wall plane [cells]."""
    below = ledger.largest(lambda entry: float((np.array(scene.lower) - entry.lowest).max()))
    above = ledger.largest(lambda entry: float((entry.highest - np.array(scene.upper)).max()))
    return max(below, above) / scenes.SPACING


@case("all-corners")
def all_corners(probe: Probe) -> None:
    """A cube is thrown at 3 m/s into each of the eight corners: over edges and all six walls, and back."""
    from zoobench.sim.solver import Solver

    positions = scenes.lattice((0.3125, 0.3125, 0.3125), (4, 4, 4))
    found = []
    for signs in 2.0 * np.indices((2, 2, 2)).reshape(3, -1).T - 1.0:
        body = scenes.passive(positions, velocity=3.0 * signs)
        scene = scenes.flight(body, _SIDE)
        rollout, ledger = episode(probe, Solver(scene, scenes.fidelity()), 40)
        healthy(probe, rollout)
        returned = float((-signs * rollout.velocities[-1, 0].mean(0)).min())
        found.append((_escape(ledger, scene), ledger.growth, float(rollout.smallest_j.min()), returned))
    escape, growth, smallest, back = np.array(found).T
    # the stencil of a particle reaches two nodes beyond the constrained ones that are there
    probe.below("beyond a wall [cells]", float(escape.max()), WALL_NODES - 2.0)
    probe.below("energy / initial", float(growth.max()), GROWTH)
    probe.above("smallest J", float(smallest.min()), 0.05)
    probe.above("speed of return along each axis [m/s]", float(back.min()), 0.3)


@case("launched-at-the-edge")
def launched_at_the_edge(probe: Probe) -> None:
    """A cube that touches a wall is driven into it at 8 m/s; one that begins beyond it is refused."""
    from zoobench.sim.solver import Solver

    for axis in range(3):
        corner = [0.3125, 0.3125, 0.3125]
        corner[axis] = _SIDE - 4 * scenes.SPACING
        velocity = np.zeros(3)
        velocity[axis] = 8.0
        scene = scenes.flight(
            scenes.passive(scenes.lattice((corner[0], corner[1], corner[2]), (4, 4, 4)), velocity=velocity), _SIDE
        )
        rollout, ledger = episode(probe, Solver(scene, scenes.fidelity()), 20)
        healthy(probe, rollout)
        probe.below(f"axis {axis}: beyond the wall [cells]", _escape(ledger, scene), 1.0)
        probe.below(f"axis {axis}: energy / initial", ledger.growth, GROWTH)
    outside = scenes.lattice((_SIDE - scenes.SPACING, 0.3, 0.3), (2, 2, 2))
    probe.refuses(
        "a body across the wall", "lie outside the arena", lambda: scenes.flight(scenes.passive(outside), _SIDE)
    )


@case("on-the-nodes")
def on_the_nodes(probe: Probe) -> None:
    """Lone particles exactly on nodes, cell borders and wall planes, moving alike: the grid changes nothing."""
    from zoobench.sim.solver import Solver

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
        ledger = march(probe, solver, 20, solver.dt, every=1)
        mass = float(solver.parameters.mass.sum())
        drift = ledger.largest(lambda entry, mass=mass: float(np.abs(entry.momentum / mass - velocity).max()))  # type: ignore[misc]
        probe.below(f"{precision} bits: change of velocity / speed", drift / float(np.linalg.norm(velocity)), tolerance)
        probe.below(f"{precision} bits: |J - 1|", abs(ledger.smallest(lambda e: e.smallest_j) - 1.0), 1e2 * tolerance)
    solver = Solver(scenes.flight(scenes.passive(at_walls), side), scenes.fidelity())
    rollout, ledger = episode(probe, solver, 20)
    healthy(probe, rollout)
    moved = float(np.abs(rollout.positions[-1] - rollout.positions[0]).max())
    probe.below("moved at rest on the wall planes [m]", moved, 0.0)


def _tumbling(shift: float) -> Scene:
    """A cube that falls on rough ground and tumbles, `shift` [m] away from the origin along x and z."""
    body = scenes.passive(scenes.lattice((0.3125, 0.0625, 0.3125), (4, 4, 4)), scenes.MUSCLE)
    away = np.array([shift, 0.0, shift])
    body = replace(body, positions=body.positions + away, velocities=body.velocities + np.array([1.5, -1.0, 0.4]))
    lower = (shift, 0.0, shift)
    return Scene(body, lower, (shift + 1.5, _SIDE, shift + 1.5), ground=Ground(0.5))


@case("far-from-origin")
def far_from_origin(probe: Probe) -> None:
    """The same tumbling cube 0, 1, 10 and 100 m from the origin, in 32 bits: places count from the arena's corner."""
    from zoobench.sim.solver import Solver

    paths = []
    for shift in (0.0, 1.0, 10.0, 100.0):
        solver = Solver(_tumbling(shift), scenes.fidelity())
        rollout, ledger = episode(probe, solver, 60)
        healthy(probe, rollout)
        probe.below(f"{shift:g} m: energy / initial", ledger.growth, GROWTH)
        paths.append(solver.matter.x[0, 0].numpy().copy())
    for shift, path in zip((1.0, 10.0, 100.0), paths[1:], strict=True):
        probe.below(f"{shift:g} m: largest difference of places [m]", float(np.abs(path - paths[0]).max()), 0.0)


@case("off-the-lattice")
def off_the_lattice(probe: Probe) -> None:
    """The tumbling cube shifted by fractions of a cell along the ground: where it lies on the grid hardly matters."""
    from zoobench.sim.solver import Solver

    ends = []
    for fraction in (0.0, 0.25, 0.5):
        scene = _tumbling(0.0)
        away = np.array([1.0, 0.0, 1.0]) * fraction * scenes.SPACING
        scene = replace(scene, robot=replace(scene.robot, positions=scene.robot.positions + away))
        rollout, ledger = episode(probe, Solver(scene, scenes.fidelity()), 40)
        healthy(probe, rollout)
        probe.below(f"{fraction:g}: energy / initial", ledger.growth, GROWTH)
        ends.append(rollout.positions[-1, 0].mean(0) - away)
    spread = float(np.abs(np.array(ends) - ends[0]).max()) / scenes.SPACING
    probe.below("spread of the centre's end [cells]", spread, 1.0)
