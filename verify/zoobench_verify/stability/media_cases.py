"""Media: impacts, separation and load cycles of granular and plastic ones; breaking, rest and buoyancy of water."""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.snow import LARGEST_PLASTIC, SMALLEST_PLASTIC, SnowMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.solver import Solver
from zoobench_verify.energies import medium_strain, to_array
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import GROWTH, EnergyHistory, EpisodeRecorder, case

_H = scenes.SPACING


def heavy_drop(record: EpisodeRecorder, name: str) -> None:
    """A block of rubber hits a bed of a medium at 10 m/s."""
    medium = scenes.bed_of(scenes.medium_material(name), scenes.lattice(scenes.ORIGIN, (12, 3, 12)))
    positions = scenes.lattice((4.5 * _H, 3 * _H, 4.5 * _H), (3, 3, 3))
    body = scenes.passive(positions, velocity=np.array([0.0, -10.0, 0.0]))
    scene = Scene(body, scenes.ORIGIN, (12 * _H, 0.75, 12 * _H), medium=medium, ground=Ground(0.5))
    solver = Solver(scene, scenes.fidelity(), frame_seconds=0.002)
    rollout, energies = record.episode(solver, 50)
    record.energy_bounded(energies)
    record.stays_above(energies, scenes.SPACING)
    record.at_least("smallest J of the robot", rollout.smallest_j.min(), 0.05)
    taken = solver.frame_seconds / float(rollout.counts.max())
    record.at_most("step / dt_iso when hardest", taken / solver.limit.dt_iso, 0.9)
    strain, history = medium_strain(solver)
    if name == "snow":
        record.at_least("smallest plastic volume ratio", history.min(), SMALLEST_PLASTIC * (1.0 - 1e-6))
        record.remark(f"at the hardening cap {float((history <= SMALLEST_PLASTIC * 1.000001).mean()):.2%} of the snow")
    if name == "water":
        record.at_least("smallest J of the water", history.min(), 0.5)
    else:
        record.at_least("smallest elastic J of the medium", np.exp(strain.sum(1)).min(), 0.5)


for _name in scenes.MEDIA:
    _summary = f"A block of rubber hits a bed of {_name} at 10 m/s."
    case(f"drop-on-{_name}", args=(_name,), summary=_summary, is_fast=_name == "snow")(heavy_drop)


@case("sand-lift-off", is_fast=False)
def sand_lift_off(record: EpisodeRecorder) -> None:
    """An equilibrated box of sand is thrown up, its top faster than its foot; it parts, falls and regains its volume.

    The sand oscillates between smooth walls, where nothing shears it: its final volume is a mean over time. The volume
    of a particle is resolved as long as its neighbours are within a cell, up to twice the length with two particles
    per cell and axis; the change of volume after a harder throw is reported.
    """
    medium = scenes.bed_of(scenes.medium_material("sand"), scenes.lattice(scenes.ORIGIN, (4, 8, 4)))
    tracer = scenes.bystander((2 * _H, 4 * _H, 2 * _H))
    scene = Scene(tracer, scenes.ORIGIN, (4 * _H, 0.75, 4 * _H), medium=medium, ground=Ground(0.5))
    start = Solver(scene, scenes.fidelity(64)).equilibrate(100)
    rest = _medium_heights(Solver(scene, scenes.fidelity(64), start=start))
    for throw in (1.0, 1.5):
        solver = scenes.reset_solver(scene, start=start)
        solver.matter.v[0, 0, 1:, 1] = solver.simulation.tensor(throw * rest / (8 * _H))
        centre, tension = [], []
        for _ in range(250):
            record.march(solver, 6, solver.dt, every=6)
            centre.append(float(_medium_heights(solver).mean() / rest.mean()))
            tension.append(float(to_array(solver.matter.tau[0, 0])[:, :3].sum(1).max()) / 3.0)
        gain = float(np.mean(centre[-80:])) - 1.0
        record.at_most(f"{throw:g} m/s: largest mean tension [Pa]", max(tension), 1e-6)
        if throw == 1.0:
            record.at_least("rise of the centre / its height", max(centre), 1.1)
            record.at_most("|change of volume|", abs(gain), 0.02)
        else:
            rise = f"the centre rises to {max(centre):.2f} and the volume changes by {gain:.1%}"
            record.remark(f"at {throw:g} m/s {rise}")


def _medium_heights(solver: Solver) -> Array:
    """Heights of the medium's particles above the ground [m]."""
    heights: Array = to_array(solver.matter.x[0, 0, solver.robot_count :, 1]) + solver.origin[1]
    return heights


@case("snow-load-cycles", is_fast=False)
def snow_load_cycles(record: EpisodeRecorder) -> None:
    """Snow is driven through volume cycles far beyond its clamps: it never returns more work than was done on it.

    The velocity gradient is prescribed: the particle is so heavy that its stress cannot change it, which is checked.
    The work of the stress in a cycle is dissipated, and cannot be negative once the state repeats.
    """
    material = replace(scenes.medium_material("snow"), density=1e12)
    assert isinstance(material, SnowMaterial)
    solver = scenes.reset_solver(scenes.lone_bed(scenes.bed_of(material, np.array([[0.5, 0.5, 0.5]]))))
    works, extremes, off, dt, steps = [], [1.0, 1.0], 0.0, 1e-4, 2000
    for amplitude in (0.01, 0.5, 4.0, 0.5, 0.5):
        work = 0.0
        rates = amplitude / (0.5 * steps * dt) * np.where((np.arange(steps) // (steps // 4)) % 3 == 0, -1.0, 1.0)
        for rate in rates:
            C = np.diag([rate, 0.6 * rate, 0.4 * rate]) / 2.0
            solver.matter.C[0, 0, 1] = solver.simulation.tensor(C)
            before = to_array(solver.matter.tau[0, 0, 0])
            solver.substeps(1, dt)
            after, made = to_array(solver.matter.tau[0, 0, 0]), to_array(solver.matter.C[0, 0, 1])
            off = max(off, float(np.abs(made - C).max() / np.abs(C).max()))
            work += 0.5 * dt * float((before + after)[:3] @ np.diag(made))
            plastic = float(solver.matter.history[0, 0, 0])
            extremes = [min(extremes[0], plastic), max(extremes[1], plastic)]
        works.append(work)
    record.add_step(solver, dt)
    record.holds("stress finite", bool(np.isfinite(to_array(solver.matter.tau)).all()))
    record.at_most("velocity gradient off that prescribed, relative", off, 1e-6)
    for number, work in enumerate(works, start=1):
        record.at_least(f"work of cycle {number} [J/m^3]", work, -1e-6)
    record.at_most("hardest plastic volume ratio reached", extremes[0], SMALLEST_PLASTIC)
    record.at_least("hardest plastic volume ratio", extremes[0], SMALLEST_PLASTIC)
    record.at_least("loosest plastic volume ratio reached", extremes[1], 0.999 * LARGEST_PLASTIC)
    record.at_most("loosest plastic volume ratio", extremes[1], LARGEST_PLASTIC)


def _densest_cell(solver: Solver) -> int:
    """Largest number of the medium's particles in one grid cell."""
    places = to_array(solver.matter.x[0, 0, solver.robot_count :]) / _H
    return int(np.unique(np.floor(places), axis=0, return_counts=True)[1].max())


@case("dam-break", is_fast=False)
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
    energies, extremes, front = EnergyHistory(), [], 0.0
    solver.reset()
    for _ in range(250):
        energies.balances += record.march(solver, solver.substeps_per_frame, solver.dt, every=1000).balances[-1:]
        J = np.exp(medium_strain(solver)[0].sum(1))
        extremes.append((J.min(), J.max(), float((J > 1.1).mean())))
        front = max(front, float(solver.positions(0)[solver.robot_count :, 0].max()))
    lowest, highest, swollen = np.array(extremes).T
    right, left = energies.largest(lambda each: each.highest[0]), energies.smallest(lambda each: each.lowest[0])
    beyond = max(right - arena[0], -left)
    record.at_most("beyond a wall [cells]", beyond / _H, 1.0)
    record.at_least("front of the water / length of the tank", front / arena[0], 0.9)
    record.energy_bounded(energies)
    record.at_least("smallest J of the water", lowest.min(), 1.0 - 1.25 * float(shock))
    record.at_most("largest J of the water", highest.max(), 1.1)
    record.at_most("particles per cell / initial", _densest_cell(solver) / 8, 3.0)
    record.remark(f"largest share with J > 1.1 {swollen.max():.2%}")


def _tank(cells: tuple[int, int, int]) -> Scene:
    medium = scenes.bed_of(scenes.medium_material("water"), scenes.lattice(scenes.ORIGIN, cells))
    arena = (cells[0] * _H, (cells[1] + 8) * _H, cells[2] * _H)
    middle = (arena[0] / 2, cells[1] * _H / 2, arena[2] / 2)
    return Scene(scenes.bystander(middle), scenes.ORIGIN, arena, medium=medium, ground=Ground(0.0))


@case("tank-at-rest", is_fast=False)
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


@case("buoyant-release", is_fast=False)
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
    assert isinstance(water, WaterMaterial)
    squeeze = 9.81 * water.density * (16 * _H - places[wet, 1]) / water.bulk_modulus
    medium = scenes.bed_of(water, places[wet], np.repeat(-squeeze[:, None] / 3.0, 3, axis=1))
    medium = replace(medium, volumes=medium.volumes / medium.history)  # rest volumes of compressed water
    solver = Solver(replace(scene, robot=body, medium=medium), scenes.fidelity())
    rollout, energies = record.episode(solver, 200)
    top = float(rollout.positions[:, 0, :, 1].max())
    level = (16.0 - 162.0 / 18**2) * _H
    record.at_least("highest place of the block / level of the water", top / level, 1.0)
    record.at_most("particles per cell / initial", _densest_cell(solver) / 8, 3.0)
    # that it moves is shown by its rise: most of the energy is that of water which stays where it is
    record.at_most("energy / initial", energies.growth, GROWTH)
    record.at_least("smallest J of the block", rollout.smallest_j.min(), 0.5)
    J = np.exp(medium_strain(solver)[0].sum(1))
    record.at_least("smallest J of the water", J.min(), 0.9)
    record.at_most("largest J of the water", J.max(), 1.1)
