"""Water: thrown, at rest for long, and with a buoyant body in it."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench.sim.model.matter import ElasticMaterial, WaterMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.verify.energies import medium_strain, to_array
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import GROWTH, Ledger, episode, healthy, march

if TYPE_CHECKING:
    from zoobench.sim.solver import Solver

_H = scenes.SPACING


def _crowding(solver: "Solver") -> int:
    """Largest number of the medium's particles in one grid cell."""
    places = to_array(solver.matter.x[0, 0, solver.robot_count :]) / _H
    return int(np.unique(np.floor(places), axis=0, return_counts=True)[1].max())


@case("dam-break", fast=False)
def dam_break(probe: Probe) -> None:
    """A column of water falls, hits a block of rubber, climbs the far wall and comes back as spray.

    Water that hits a wall at v is compressed by v / c. Its front runs at 2 sqrt(g H): for less than 10 % it must be
    stiffer than in the environments, which are shallow.
    """
    from zoobench.sim.solver import Solver

    height = 10 * _H
    material = WaterMaterial(bulk_modulus=2e6, density=1000.0)
    shock = 2.0 * np.sqrt(9.81 * height) / np.sqrt(2e6 / material.density)
    medium = scenes.bed_of(material, scenes.lattice(scenes.ORIGIN, (6, 10, 3)))
    arena = (18 * _H, 30 * _H, 3 * _H)
    robot = scenes.passive(scenes.lattice((15 * _H, 0.0, 0.0), (2, 2, 3)))
    solver = Solver(Scene(robot, scenes.ORIGIN, arena, medium=medium, ground=Ground(0.5)), scenes.fidelity())
    ledger, extremes = Ledger(), []
    solver.reset()
    for _ in range(250):
        ledger.entries += march(probe, solver, solver.substeps_per_frame, solver.dt, every=1000).entries[-1:]
        J = np.exp(medium_strain(solver)[0].sum(1))
        extremes.append((J.min(), J.max(), float((J > 1.1).mean())))
    lowest, highest, swollen = np.array(extremes).T
    beyond = max(ledger.largest(lambda e: e.highest[0]) - arena[0], -ledger.smallest(lambda e: e.lowest[0]))
    probe.below("beyond a wall [cells]", beyond / _H, 1.0)
    probe.above("front / length of the tank", ledger.largest(lambda e: e.highest[0]) / arena[0], 0.9)
    probe.below("energy / initial", ledger.growth, GROWTH)
    probe.above("smallest J of the water", float(lowest.min()), 1.0 - 1.25 * float(shock))
    probe.below("largest J of the water", float(highest.max()), 1.1)
    probe.below("particles per cell / initial", _crowding(solver) / 8, 3.0)
    probe.remark(f"largest share with J > 1.1 {swollen.max():.2%}")


def _tank(cells: tuple[int, int, int]) -> Scene:
    medium = scenes.bed_of(scenes.medium_material("water"), scenes.lattice(scenes.ORIGIN, cells))
    arena = (cells[0] * _H, (cells[1] + 8) * _H, cells[2] * _H)
    place = (arena[0] / 2, cells[1] * _H / 2, arena[2] / 2)
    return Scene(scenes.bystander(place), scenes.ORIGIN, arena, medium=medium, ground=Ground(0.0))


@case("tank-at-rest", fast=False)
def tank_at_rest(probe: Probe) -> None:
    """A tank at rest is left alone for 100,000 steps: it stays at rest, and nothing grows."""
    from zoobench.sim.solver import Solver

    scene = _tank((4, 8, 4))
    start = Solver(scene, scenes.fidelity()).equilibrate(150)
    solver = Solver(scene, scenes.fidelity(), start=start)
    solver.reset()
    speed, energy, smallest, largest = [], [], [], []
    for _ in range(100):
        march(probe, solver, 1000, solver.dt, every=1000)
        v = to_array(solver.matter.v[0, 0, 1:])
        J = np.exp(medium_strain(solver)[0].sum(1))
        speed.append(float(np.sqrt(np.square(v).sum(1).mean())))
        energy.append(float(np.square(v).sum()))
        smallest.append(float(J.min()))
        largest.append(float(J.max()))
    scale = float(np.sqrt(9.81 * 8 * _H))
    probe.below("speed (rms) / sqrt(g H)", max(speed) / scale, 1e-2)
    probe.below("late kinetic energy / early", max(energy[-20:]) / max(energy[:20]), 2.0)
    probe.above("smallest J", min(smallest), 0.9)
    probe.below("largest J", max(largest), 1.1)


@case("buoyant-release", fast=False)
def buoyant_release(probe: Probe) -> None:
    """A block a quarter as dense as water is let go deep in a tank at rest: it rises and breaks the surface.

    The level is that of the water with the block afloat: of the 216 cells that the block takes, 54 are displaced when
    it floats, so that 16 cells of depth become 16 - 162 / 324 = 15.5; the water starts as compressed as its
    weight keeps it. Afloat, the block's top would be 4.5 cells above that; it gets there slowly, because the grid's
    velocity has one value at a place: a film of about a cell stays on the block and has to drain.
    """
    from zoobench.sim.solver import Solver

    scene = _tank((18, 16, 18))
    assert scene.medium is not None
    material = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=250.0)
    body = scenes.passive(scenes.lattice((6 * _H, 4 * _H, 6 * _H), (6, 6, 6)), material)
    low, high = body.positions.min(0) - 0.25 * _H, body.positions.max(0) + 0.25 * _H
    places = scene.medium.positions
    wet = ~((places > low) & (places < high)).all(1)
    water = scene.medium.material
    squeeze = 9.81 * water.density * (16 * _H - places[wet, 1]) / water.constants[1]
    medium = scenes.bed_of(water, places[wet], np.repeat(-squeeze[:, None] / 3.0, 3, axis=1))
    medium = replace(medium, volumes=medium.volumes / medium.history)  # as dense as it is compressed
    solver = Solver(replace(scene, robot=body, medium=medium), scenes.fidelity())
    rollout, ledger = episode(probe, solver, 200)
    healthy(probe, rollout)
    top = float(rollout.positions[:, 0, :, 1].max())
    level = (16.0 - 162.0 / 18**2) * _H
    probe.above("highest place of the block / level of the water", top / level, 1.0)
    probe.below("particles per cell / initial", _crowding(solver) / 8, 3.0)
    probe.below("energy / initial", ledger.growth, GROWTH)
    probe.above("smallest J of the block", float(rollout.smallest_j.min()), 0.5)
    J = np.exp(medium_strain(solver)[0].sum(1))
    probe.above("smallest J of the water", float(J.min()), 0.9)
    probe.below("largest J of the water", float(J.max()), 1.1)
