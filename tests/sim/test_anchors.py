"""Bodies that are held: a beam at its end, and an obstacle on which another comes to rest."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.test_adjoint import Probe
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.elastic_bodies import Drive, ElasticBody, SceneObject
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver

H = 0.01
GRID = Fidelity(H, precision=64)
EVERYWHERE = (((-9.0, -9.0, -9.0), (9.0, 9.0, 9.0)),)


def _box(low: tuple[float, float, float], high: tuple[float, float, float], **given: float) -> ElasticBody:
    material = ElasticMaterial(**{"youngs_modulus": 2e5, "poissons_ratio": 0.0, "density": 500.0, **given})
    positions = fill_box(np.array(low), np.array(high), H, 8)
    return ElasticBody.passive(material, positions, np.full(len(positions), (H / 2) ** 3))


@pytest.mark.slow
@pytest.mark.parametrize(("driven", "beyond"), [(False, 0.0), (True, 0.6)])
def test_a_beam_held_at_its_end_bends_as_timoshenko_says(driven: bool, beyond: float) -> None:
    """By q l^4 / 8 EI + q l^2 / 2 k G A to a tenth with four cells through its depth; the held part stays.

    Driven matter holds the nodes of its splines, so many cells beyond its end.
    """
    depth, length, clamp, gravity = 0.04, 0.2, 0.18, 0.3
    beam = _box((0.1, 0.2, 0.1), (clamp + length, 0.2 + depth, 0.1 + depth), viscosity=20.0)
    held = beam.positions[:, 0] < clamp
    anchor = () if driven else (((0.0, 0.0, 0.0), (clamp, 1.0, 1.0)),)
    beam = replace(beam, anchor=anchor, drive=Drive(held, speed=1.0) if driven else None)
    solver = Solver(Scene(beam, (0.0, 0.0, 0.0), (0.46, 0.4, 0.24), gravity=(0.0, -gravity, 0.0)), GRID)
    solver.start_at(solver.equilibrate(150))
    solver.reset()
    moved = solver.positions(0) - beam.positions
    tip, held = beam.positions[:, 0] > clamp + length - H / 2, beam.positions[:, 0] < clamp - H
    reach, load = length - H / 4 - beyond * H, 500.0 * gravity * depth**2
    bending, shear = load * reach**4 / (8 * 2e5 * depth**4 / 12), load * reach**2 / (2 * 5 / 6 * 1e5 * depth**2)
    assert -moved[tip, 1].mean() / (bending + shear) == pytest.approx(1.0, abs=0.1)
    assert np.abs(moved[held]).max() < 1e-3 * bending


@pytest.mark.slow
def test_what_lies_on_an_obstacle_stays_there_and_so_does_the_obstacle() -> None:
    """A block on a held table sinks by less than a third of a cell, slower and slower; the table does not move."""
    table = replace(_box((0.05, 0.04, 0.05), (0.15, 0.06, 0.15), density=1e6), anchor=EVERYWHERE)
    block = _box((0.08, 0.0625, 0.08), (0.12, 0.1025, 0.12), viscosity=5.0)
    scene = Scene(block, (0.0, 0.0, 0.0), (0.2, 0.2, 0.2), objects=(SceneObject("table", table),))
    solver = Solver(scene, GRID)
    solver.start_at(solver.equilibrate(60))
    solver.reset()
    heights = []
    for _ in range(3):
        heights.append(solver.positions(0)[: block.particle_count, 1].mean())
        solver.substeps(round(0.05 / solver.dt))
    assert abs(heights[0] - block.positions[:, 1].mean()) < H / 3
    assert abs(heights[2] - heights[1]) < 1e-5
    assert np.abs(solver.positions(0)[scene.slice_of("table")] - table.positions).max() < 1e-12


def _bridge_scene() -> Scene:
    """The muscle cube, half over the held end of a plank and half over its free middle, falls on it."""
    cube, cell = scenes.muscle_body((0.3, 0.34, 0.3), moving=True), scenes.SPACING
    plank = scenes.passive_block((0.25, 0.34 - 2.25 * cell, 0.28), (9, 2, 4), np.zeros(3))
    span = 0.36, 0.48
    ends = ((-9.0, span[0]), (span[1], 9.0))
    plank = replace(
        plank,
        material=replace(plank.material, youngs_modulus=4e4, density=500.0),
        anchor=tuple(((low, -9.0, -9.0), (high, 9.0, 9.0)) for low, high in ends),
    )
    gravity = (0.5, -9.81, 0.2)
    return Scene(cube, (0.0, 0.0, 0.0), scenes.ARENA, gravity=gravity, objects=(SceneObject("plank", plank),))


@pytest.mark.slow  # the conformance suite has the gradient of obstacles
def test_a_body_on_what_hangs_between_two_ends_has_an_exact_gradient() -> None:
    """By activity and by the body; the middle has given way, the ends have not."""
    scene = _bridge_scene()
    probe = Probe(scene, 12)
    gradient = probe.gradient()
    rest, now = scene.objects[0].body.positions, probe.rollout.positions[-1, 0, scene.slice_of("plank")]
    moved, apart = np.abs(now - rest).max(axis=1), 1.5 * scenes.SPACING
    assert moved[(rest[:, 0] < 0.36 - apart) | (rest[:, 0] > 0.48 + apart)].max() == 0.0
    assert moved.max() > 1e-3
    for name in scenes.GROUPS:
        direction = np.random.default_rng(5).uniform(-1.0, 1.0, probe.base[name].shape)
        assert probe.error(gradient, name, direction, 1e-6) <= 1e-5, name


@pytest.mark.slow
def test_what_lies_on_the_held_end_of_a_soft_body_does_not_sink() -> None:
    """As on an obstacle, all of which is held, though nodes there are no heavier than what lies on them."""
    free = (0.15 + 2 * H, 0.2)
    table = _box((0.05, 0.04, 0.05), (0.25, 0.06, 0.15))
    anchor = tuple(((low, -9.0, -9.0), (high, 9.0, 9.0)) for low, high in ((-9.0, free[0]), (free[1], 9.0)))
    block = _box((0.08, 0.0625, 0.08), (0.12, 0.1025, 0.12), viscosity=5.0)
    ends = SceneObject("table", replace(table, anchor=anchor))
    solver = Solver(Scene(block, (0.0, 0.0, 0.0), (0.3, 0.2, 0.2), objects=(ends,)), GRID)
    solver.start_at(solver.equilibrate(60))
    solver.reset()
    heights = []
    for _ in range(2):
        heights.append(solver.positions(0)[: block.particle_count, 1].mean())
        solver.substeps(round(0.1 / solver.dt))
    assert abs(heights[0] - block.positions[:, 1].mean()) < H / 3
    assert abs(heights[1] - heights[0]) < 1e-5


@pytest.mark.parametrize("given", [{"anchor": EVERYWHERE}, {"drive": Drive(np.ones(512, np.bool_), 1.0)}])
def test_a_robot_in_its_rest_frame_cannot_be_held(given: dict[str, Any]) -> None:
    """It would fall: its nodes are its own."""
    beam = replace(_box((0.08, 0.08, 0.08), (0.12, 0.12, 0.12)), **given)
    with pytest.raises(UsageError, match="cannot be held"):
        Solver(Scene(beam, (0.0, 0.0, 0.0), (0.2, 0.2, 0.2)), replace(GRID, robot="lagrangian"))


def test_an_arena_that_follows_cannot_hold_a_body() -> None:
    """The anchor would be left behind."""
    beam = replace(_box((0.08, 0.08, 0.08), (0.12, 0.12, 0.12)), anchor=EVERYWHERE)
    with pytest.raises(SceneError, match="anchored in an arena that stays"):
        Scene(beam, (0.0, 0.0, 0.0), (0.2, 0.2, 0.2), follows=True)


def test_a_base_moves_where_the_arena_stays() -> None:
    """Elsewhere it is refused."""
    beam = _box((0.08, 0.08, 0.08), (0.12, 0.12, 0.12))
    beam = replace(beam, drive=Drive(np.ones(beam.particle_count, np.bool_), 1.0))
    with pytest.raises(SceneError, match="base of a robot can move on firm ground"):
        Scene(beam, (0.0, 0.0, 0.0), (0.2, 0.2, 0.2), follows=True)
