"""Arenas that follow their robot: the same motion as in one that is long enough, and exact gradients."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.test_adjoint import Probe
from tests.sim.test_tape import STORED
from tests.sim.wet_scenes import stirred
from zoobench.arrays import Array
from zoobench.envs.bed import Bed
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.rollout import ArenaMove, Gradient, Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.terrain import Terrain
from zoobench.sim.moving_arena import MovingArena, carry_out
from zoobench.sim.playback import Playback
from zoobench.sim.solver import BodyState, Solver

CELLS = 14
"""Of the arena along x and z."""

FRAMES = 8
SLEEP = 0.01
KINDS = pytest.mark.parametrize(
    "kind", ["ground", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("sand", "mud", "water"))]
)


def _scene(kind: str, *, cells: int = CELLS, velocity: tuple[float, float, float] = (2.5, -0.2, -1.2)) -> Scene:
    """The muscle cube thrown ahead and to the left from the middle of an arena that follows it."""
    if kind == "water":
        return _in_water(cells, velocity)
    size = np.array([cells, 12, cells]) * scenes.SPACING
    medium = None
    if kind != "ground":
        bed = Bed(scenes.MEDIA[kind], scenes.SPACING, robot_friction=0.3)
        medium = bed.fill(size, 9.81, scenes.fidelity())
    corner = (cells / 2 - 1.5) * scenes.SPACING
    body = scenes.muscle_body((corner, 0.9 * scenes.SPACING if medium else 0.004, corner))
    body = replace(body, velocities=np.tile(velocity, (body.particle_count, 1)))
    upper = (float(size[0]), float(size[1]), float(size[2]))
    return Scene(body, (0.0, 0.0, 0.0), upper, ground=Ground(0.1), medium=medium, follows=True)


def _in_water(cells: int, velocity: tuple[float, float, float]) -> Scene:
    """In stirred water on a grid, in which it is as heavy as lead: so it goes far before it is stopped."""
    corner = (cells / 2 - 1.5) * scenes.SPACING
    body = scenes.muscle_body((corner, 2.5 * scenes.SPACING, corner))
    material = replace(body.material, density=11000.0, viscosity=1e-9)
    body = replace(body, material=material, velocities=np.tile(velocity, (body.particle_count, 1)))
    size, water = (cells * scenes.SPACING, 8 * scenes.SPACING, cells * scenes.SPACING), stirred((cells, 8, cells))
    gravity = (4.0 * velocity[0] / 2.5, 0.0, 0.0) if velocity[0] else scenes.NO_GRAVITY
    return Scene(body, (0.0, 0.0, 0.0), size, gravity=gravity, water=GridWater(velocities=water), follows=True)


def _fidelity(precision: int = 64) -> Fidelity:
    return replace(scenes.fidelity(precision), sleep=SLEEP)


def _run(scene: Scene, frames: int = FRAMES, **options: Any) -> tuple[Solver, Rollout]:
    solver = Solver(scene, _fidelity(), **options)
    return solver, solver.run(scenes.actuation(solver, frames))


def _moved(rollout: Rollout) -> Array:
    """Cells that the arena of the first world has moved along x and z."""
    return rollout.offsets[-1, 0, [0, 2]] / scenes.SPACING


def test_on_firm_ground_nothing_but_the_rounding_changes() -> None:
    """The robot goes as in an arena of three times the size, out of the place of the one that follows it."""
    _, found = _run(_scene("ground"))
    _, expected = _run(replace(_scene("ground", cells=3 * CELLS), follows=False))
    apart = CELLS * scenes.SPACING  # between the middles
    moved = found.positions - expected.positions + np.array([apart, 0.0, apart])
    assert np.abs(moved).max() < 1e-12
    assert _moved(found)[0] >= 4
    assert _moved(found)[1] <= -2


@KINDS
def test_the_robot_stays_in_the_middle(kind: str) -> None:
    """Within a step and the way of a frame, whichever way it goes."""
    _, rollout = _run(_scene(kind))
    middle = 0.5 * (rollout.positions.min(axis=2) + rollout.positions.max(axis=2))
    off = (middle - rollout.offsets)[:, 0, [0, 2]] - 0.5 * CELLS * scenes.SPACING
    assert np.abs(off).max() < 2.0 * scenes.SPACING
    assert np.abs(middle[-1] - middle[0]).max() > 4.0 * scenes.SPACING


@pytest.mark.slow
def test_a_bed_is_as_good_as_a_long_one() -> None:
    """The robot's way in sand, of which much sleeps, differs by less than 1 % from that in a bed of twice the size."""
    _, found = _run(_scene("sand"))
    _, expected = _run(_scene("sand", cells=2 * CELLS))
    _, still = _run(replace(_scene("sand", cells=2 * CELLS), follows=False))
    ways = [each.positions[-1, 0].mean(axis=0) - each.positions[0, 0].mean(axis=0) for each in (found, expected, still)]
    assert np.linalg.norm(ways[2]) > 2 * scenes.SPACING
    assert np.linalg.norm(ways[0] - ways[2]) < 0.01 * np.linalg.norm(ways[2])
    assert np.linalg.norm(ways[1] - ways[2]) < 0.01 * np.linalg.norm(ways[2])
    assert np.abs(_moved(found)).min() >= 1


@pytest.mark.parametrize("cells", [2, -3])
@pytest.mark.parametrize("axis", [0, 2])
def test_what_is_left_behind_is_fresh_before_the_robot(axis: int, cells: int) -> None:
    """A bed at rest is the same after a move: no particle is doubled or lost, and none leaves its place in the bed."""
    scene = _scene("sand", velocity=(0.0, 0.0, 0.0))
    solver = Solver(scene, _fidelity())
    sim, count = solver.simulation, solver.robot_count
    before, robot = solver.positions(0)[count:], solver.positions(0)[:count]
    move = MovingArena(sim)._move(0, axis, cells)
    MovingArena(sim).repeat(0, [move])
    after = solver.positions(0)[count:]
    expected = before + np.eye(3)[axis] * cells * scenes.SPACING
    # the lattice is the same everywhere, so that it is moved by itself
    np.testing.assert_allclose(_sorted(after), _sorted(expected), atol=1e-12)
    np.testing.assert_allclose(solver.positions(0)[:count], robot, atol=1e-12)
    assert len(move.renewed) == abs(cells) * 2 * 2 * CELLS * 2


def _sorted(places: Array) -> Array:
    rounded = np.round(places, 9)
    return places[np.lexsort(rounded.T)]


DIFFERENTIATED = ["ground", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("sand", "water"))]
"""Sand has all that moves with an arena: the robot, matter that is renewed, and what sleeps; the conformance suite has
its gradient in the desert."""


@pytest.fixture(scope="module", params=DIFFERENTIATED)
def probed(request: pytest.FixtureRequest) -> tuple[Probe, Gradient]:
    """The thrown cube, with the moves of the base point."""
    probe = Probe(_scene(request.param), 6, fidelity=_fidelity())
    return probe, probe.gradient()


@pytest.mark.parametrize("name", scenes.GROUPS)
def test_the_gradient_is_that_of_differences(probed: tuple[Probe, Gradient], name: str) -> None:
    """Through moves along both axes, and with matter that is renewed while it moves."""
    probe, gradient = probed
    assert {move.axis for moves in probe.rollout.moves.values() for move in moves} == {0, 2}
    direction = np.random.default_rng(7).uniform(-1.0, 1.0, probe.base[name].shape)
    assert probe.error(gradient, name, direction, enough=1e-6) <= 1e-6


@pytest.mark.parametrize(
    "kind", ["ground", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("sand", "water"))]
)
def test_moves_are_repeated_where_little_is_stored(kind: str) -> None:
    """Bit for bit: where a frame is simulated again, its arena moves again."""
    expected, gradient = _pushed(kind)
    assert expected.moves
    assert {frame % 2 for frame, _ in expected.moves} == {0, 1}  # between two segments, and in the midst of one
    for name, stored in STORED.items():
        found, other = _pushed(kind, **stored)
        np.testing.assert_array_equal(found.positions, expected.positions, name)
        assert found.moves.keys() == expected.moves.keys(), name
        assert scenes.same(other, gradient), name


def _pushed(kind: str, **stored: int) -> tuple[Rollout, Gradient]:
    """Two worlds driven ahead by tilted gravity after a short rest, and their gradient; memory in states."""
    scene = replace(_scene(kind, velocity=(0.0, 0.0, 0.0)), gravity=(60.0, -9.81, -40.0))
    if "memory" in stored:
        stored = {"memory": stored["memory"] * Solver(scene, _fidelity(), worlds=2).matter.bytes_per_slot()}
    options: dict[str, Any] = {"worlds": 2, "gradients": True, **stored}
    solver = Solver(scene, _fidelity(), **options)
    rollout = solver.run(scenes.actuation(solver, 8), equilibration=2)
    return rollout, solver.backward(rollout, *scenes.path_weights(solver, 8))


@pytest.mark.parametrize("kind", ["ground", "sand", pytest.param("water", marks=pytest.mark.slow)])
def test_a_world_moves_alike_frame_by_frame_and_again(kind: str) -> None:
    """Bit for bit, beside another world and after it was begun anew."""
    _, expected = _run(_scene(kind), 5, worlds=2)
    play = Playback(Solver(_scene(kind), _fidelity()))
    for _ in range(2):
        play.begin([0])
        for frame in range(5):
            play.frame(expected.actuation[frame, 1:])
            np.testing.assert_array_equal(play.rollout.positions[1, 0], expected.positions[frame + 1, 1])
    assert {world for _, world in expected.moves} == {0, 1}


def test_an_episode_counts_its_moves_from_its_own_beginning() -> None:
    """Not from that of the equilibration before it."""
    whole, _ = _pushed("ground")
    assert whole.moves
    for frame, world in whole.moves:
        assert whole.episode.moves[frame - whole.equilibration, world] is whole.moves[frame, world]


def test_a_replay_moves_as_it_is_told() -> None:
    """Where the robot of another actuation would have moved its arena otherwise, too."""
    solver, first = _run(_scene("ground"), 5)
    again = solver.run(-first.actuation, replay=first)
    assert again.moves.keys() == first.moves.keys()
    np.testing.assert_array_equal(again.offsets, first.offsets)


def test_what_is_renewed_has_the_state_of_its_source() -> None:
    """Whatever its own was."""
    solver = Solver(_scene("sand"), _fidelity())
    sim, count = solver.simulation, solver.robot_count
    renewed, sources = np.array([count, count + 5]), np.array([count + 9, count + 2])
    sim.matter.state[0, 0, renewed] = np.nan
    carry_out(sim, sim.matter, 0, 0, ArenaMove(0, 1, renewed, sources))
    np.testing.assert_array_equal(sim.matter.state[0, 0, renewed], sim.start.state[0, 0, sources])


def test_an_arena_follows_what_there_is_of_the_robot() -> None:
    """Particles that are absent, and stay behind, do not hold it back."""
    scene = _scene("ground")
    occupancy = np.where(scene.robot.positions[:, 0] > scene.robot.positions[:, 0].mean(), 0.9, 0.0)[None]
    solver = Solver(scene, _fidelity())
    rollout = solver.run(scenes.actuation(solver, FRAMES), BodyState(occupancy=occupancy))
    there = rollout.positions[:, 0, occupancy[0] > 0.5] - rollout.offsets[:, :1]
    middle = 0.5 * (there.min(axis=1) + there.max(axis=1))[:, [0, 2]]
    assert np.abs(middle - middle[0]).max() < 2.0 * scenes.SPACING
    assert _moved(rollout)[0] >= 4


def test_an_arena_with_a_terrain_or_a_surface_of_water_cannot_follow() -> None:
    """It is refused, with what to leave out."""
    scene = _scene("ground")
    hilly = Ground(0.5, Terrain(np.full((5, 5), 0.01), 0.2))
    for changed in ({"ground": hilly}, {"medium": scenes.medium_bed("water")}):
        with pytest.raises(SceneError, match=r"terrain or in water of particles\. Leave them out"):
            replace(scene, **changed)
