"""Water: a dam break, a long time at rest, and a buoyant body."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.matter import ElasticMaterial, WaterMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.solver import Solver
from zoobench.verify.cases import Case
from zoobench.verify.energies import medium_strain, to_array
from zoobench.verify.stability import stability_scenes as scenes
from zoobench.verify.stability.episode_recorder import EnergyHistory, EpisodeRecorder, case

CASES: list[Case] = []

_H = scenes.SPACING


def _densest_cell(solver: Solver) -> int:
    """Largest number of the medium's particles in one grid cell."""
    places = to_array(solver.matter.x[0, 0, solver.robot_count :]) / _H
    return int(np.unique(np.floor(places), axis=0, return_counts=True)[1].max())


@case(CASES, "dam-break", is_fast=False)
def dam_break(record: EpisodeRecorder) -> None:
    """A column of water falls, hits a block of rubber, climbs the far wall and returns as spray.

    Water that hits a wall at v is compressed by v / c. Its front runs at 2 sqrt(g H): for less than 10 % it must be
    stiffer than in the environments, which are shallow.
    """
    height = 10 * _H
    material = WaterMaterial(bulk_modulus=2e6, density=1000.0)
    shock = 2.0 * np.sqrt(9.81 * height) / np.sqrt(2e6 / material.density)
    medium = scenes.bed_of(material, scenes.lattice(scenes.ORIGIN, (6, 10, 3)))
    arena = (18 * _H, 30 * _H, 3 * _H)
    robot = scenes.passive(scenes.lattice((15 * _H, 0.0, 0.0), (2, 2, 3)))
    solver = Solver(Scene(robot, scenes.ORIGIN, arena, medium=medium, ground=Ground(0.5)), scenes.fidelity())
    energies, extremes = EnergyHistory(), []
    solver.reset()
    for _ in range(250):
        energies.balances += record.march(solver, solver.substeps_per_frame, solver.dt, every=1000).balances[-1:]
        J = np.exp(medium_strain(solver)[0].sum(1))
        extremes.append((J.min(), J.max(), float((J > 1.1).mean())))
    lowest, highest, swollen = np.array(extremes).T
    front = energies.largest(lambda balance: balance.highest[0])
    beyond = max(front - arena[0], -energies.smallest(lambda balance: balance.lowest[0]))
    record.at_most("beyond a wall [cells]", beyond / _H, 1.0)
    record.at_least("front / length of the tank", front / arena[0], 0.9)
    record.energy_bounded(energies)
    record.at_least("smallest J of the water", lowest.min(), 1.0 - 1.25 * float(shock))
    record.at_most("largest J of the water", highest.max(), 1.1)
    record.at_most("particles per cell / initial", _densest_cell(solver) / 8, 3.0)
    record.remark(f"largest share with J > 1.1 {swollen.max():.2%}")


def _tank(cells: tuple[int, int, int]) -> Scene:
    medium = scenes.bed_of(scenes.medium_material("water"), scenes.lattice(scenes.ORIGIN, cells))
    arena = (cells[0] * _H, (cells[1] + 8) * _H, cells[2] * _H)
    place = (arena[0] / 2, cells[1] * _H / 2, arena[2] / 2)
    return Scene(scenes.bystander(place), scenes.ORIGIN, arena, medium=medium, ground=Ground(0.0))


@case(CASES, "tank-at-rest", is_fast=False)
def tank_at_rest(record: EpisodeRecorder) -> None:
    """A tank at rest is simulated for 100,000 steps: it stays at rest, and no disturbance grows."""
    scene = _tank((4, 8, 4))
    start = Solver(scene, scenes.fidelity()).equilibrate(150)
    solver = Solver(scene, scenes.fidelity(), start=start)
    solver.reset()
    speed, energy, smallest, largest = [], [], [], []
    for _ in range(100):
        record.march(solver, 1000, solver.dt, every=1000)
        v = to_array(solver.matter.v[0, 0, 1:])
        J = np.exp(medium_strain(solver)[0].sum(1))
        speed.append(float(np.sqrt(np.square(v).sum(1).mean())))
        energy.append(float(np.square(v).sum()))
        smallest.append(float(J.min()))
        largest.append(float(J.max()))
    scale = float(np.sqrt(9.81 * 8 * _H))
    record.at_most("speed (rms) / sqrt(g H)", max(speed) / scale, 1e-2)
    record.at_most("late kinetic energy / early", max(energy[-20:]) / max(energy[:20]), 2.0)
    record.at_least("smallest J", min(smallest), 0.9)
    record.at_most("largest J", max(largest), 1.1)


@case(CASES, "buoyant-release", is_fast=False)
def buoyant_release(record: EpisodeRecorder) -> None:
    """A block a quarter as dense as water is released deep in a tank at rest: it rises and breaks the surface.

    The level is that of the water with the block afloat: of the 216 cells of the block, 54 are displaced when it
    floats, so that 16 cells of depth become 16 - 162 / 324 = 15.5; the water starts in hydrostatic compression.
    Afloat, the block's top would be 4.5 cells above that. It rises slowly, because the grid has a single velocity at
    each point: a film of about a cell remains on the block and has to drain.
    """
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
    medium = replace(medium, volumes=medium.volumes / medium.history)  # rest volumes of compressed water
    solver = Solver(replace(scene, robot=body, medium=medium), scenes.fidelity())
    rollout, energies = record.episode(solver, 200)
    top = float(rollout.positions[:, 0, :, 1].max())
    level = (16.0 - 162.0 / 18**2) * _H
    record.at_least("highest place of the block / level of the water", top / level, 1.0)
    record.at_most("particles per cell / initial", _densest_cell(solver) / 8, 3.0)
    record.energy_bounded(energies)
    record.at_least("smallest J of the block", rollout.smallest_j.min(), 0.5)
    J = np.exp(medium_strain(solver)[0].sum(1))
    record.at_least("smallest J of the water", J.min(), 0.9)
    record.at_most("largest J of the water", J.max(), 1.1)
