"""Matter that sleeps: which does, what it adds to the motion of the rest, and gradients beside it."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.sim import scenes
from tests.sim.test_adjoint import Probe
from tests.sim.test_tape import STORED
from zoobench.envs.bed import Bed
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity, Transfer
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.playback import Playback
from zoobench.sim.sleep import REACH
from zoobench.sim.solver import Solver

SLOW = 0.01
"""A threshold [m/s] of which a share of the bed sleeps most of the time."""

SIZE = (16 * scenes.SPACING, 0.5, 14 * scenes.SPACING)


_CASES = [
    # each compiles kernels of its own, and beds of the benchmark are in two fields
    pytest.param(False, id="one-field", marks=pytest.mark.slow),
    pytest.param(True, id="two-fields"),
]
FIELDS = pytest.mark.parametrize("slip", _CASES)


def _scene(slip: bool = True, matter: str = "sand") -> Scene:
    """The muscle cube landing on one end of a bed from wall to wall, which carries its weight and creeps by nothing.

    With slip it is pressed into the bed a little, which it meets in a velocity field of its own.
    """
    bed = Bed(scenes.MEDIA[matter], scenes.SPACING, robot_friction=0.3 if slip else None)
    medium = bed.fill(np.array(SIZE), 9.81, scenes.fidelity())
    creeping = replace(medium, velocities=np.full_like(medium.positions, 1e-12))
    height = (0.9 if slip else 1.0) * scenes.SPACING
    body = scenes.muscle_body((3 * scenes.SPACING, height, 5 * scenes.SPACING), moving=True)
    return Scene(body, (0.0, 0.0, 0.0), SIZE, ground=Ground(0.5), medium=creeping)


def _fidelity(sleep: float, transfer: Transfer = "apic") -> Fidelity:
    return replace(scenes.fidelity(transfer=transfer), sleep=sleep)


def _run(scene: Scene, sleep: float, frames: int, **options: Any) -> tuple[Solver, Rollout]:
    solver = Solver(scene, _fidelity(sleep), **options)
    return solver, solver.run(scenes.actuation(solver, frames))


def test_matter_is_awake_near_what_moves() -> None:
    """Within `REACH` cells of the robot, or of matter as fast as the threshold, in every direction; nowhere else."""
    scene = _scene()
    medium = scene.medium
    assert medium is not None
    velocities = np.array(medium.velocities)
    velocities[0] = [0.0, 0.0, SLOW]
    velocities[-1] = [0.0, 0.0, np.nextafter(SLOW, 0.0)]
    scene = replace(scene, medium=replace(medium, velocities=velocities))
    _, rollout = _run(scene, SLOW, 1)
    movers = np.concatenate([scene.robot.positions, medium.positions[:1]])
    cells, moving = (np.floor(places / scenes.SPACING + 1e-9) for places in (medium.positions, movers))
    distance = np.abs(cells[:, None] - moving).max(axis=2).min(axis=1)
    np.testing.assert_array_equal(rollout.asleep[0, 0], distance > REACH)
    assert 0.1 < rollout.asleep.mean() < 0.9
    assert rollout.asleep[0, 0, -1]


@pytest.mark.parametrize(
    ("matter", "transfer", "slip"),
    [
        ("sand", "apic", True),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            # clay's volume changes as that around it (F-bar), of which matter asleep is a part
            for case in (
                ("sand", "apic", False),
                ("sand", "aflip", True),
                ("sand", "aflip", False),
                ("clay", "apic", True),
            )
        ),
    ],
)
def test_awake_matter_feels_all_of_the_matter_asleep(matter: str, transfer: Transfer, slip: bool) -> None:
    """In one substep it moves as if nothing slept; what sleeps keeps its state, and lets go of the rest's impulse.

    The total momentum differs by what the matter asleep would have taken: the reaction of what holds it.
    """
    scene = _scene(slip, matter)
    states = []
    for sleep in (0.0, SLOW):
        solver = Solver(scene, _fidelity(sleep, transfer))
        solver.run(scenes.actuation(solver, 3))  # in full motion, from a state of its own below
        if not states:
            solver.simulation.put_to_sleep(np.zeros((1, 0), np.bool_))
            states.append(solver.matter.copy_slot(0))
        sim = solver.simulation
        sim.matter.load_slot(0, states[0])
        sim.refresh_window()
        asleep = np.zeros((1, sim.sleepers), np.bool_)
        asleep[:, ::3] = True  # among the others, not far from them
        sim.put_to_sleep(asleep)
        sim.advance(sim.matter, np.zeros(1, np.int64), np.ones(1, np.int64), stride=0)
        states.append(sim.matter.copy_slot(0))
    before, free, held = (np.array(state.state[0, 0].numpy()) for state in states)
    sleeps = np.concatenate([np.zeros(solver.robot_count, np.bool_), asleep[0]])
    np.testing.assert_array_equal(held[sleeps], before[sleeps])
    np.testing.assert_allclose(held[~sleeps], free[~sleeps], rtol=1e-10, atol=1e-10 * np.abs(free).max())
    mass = solver.parameters.mass[0].numpy()
    reaction = mass[sleeps] @ (free - before)[sleeps, 1, :3]
    assert np.abs(reaction).max() > 1e-6
    np.testing.assert_allclose(mass @ held[:, 1, :3] + reaction, mass @ free[:, 1, :3], rtol=1e-12)


@FIELDS
def test_motion_converges_with_threshold_and_reach(monkeypatch: pytest.MonkeyPatch, slip: bool) -> None:
    """To that of a bed of which nothing sleeps; with the threshold alone, up to the waves that outrun the reach."""
    scene = _scene(slip)
    _, free = _run(scene, 0.0, 12)
    moved = np.abs(free.positions - free.positions[0]).max()

    def error(sleep: float, reach: int) -> float:
        monkeypatch.setattr("zoobench.sim.sleep.REACH", reach)
        _, rollout = _run(scene, sleep, 12)
        assert 0.001 < rollout.asleep.mean() < 0.9
        return float(np.abs(rollout.positions - free.positions).max() / moved)

    loose, strict, *far = (error(*each) for each in ((0.03, REACH), (1e-6, REACH), (1e-6, 4), (1e-6, 6), (1e-6, 8)))
    assert 1e-2 > loose > strict
    for nearer, farther in pairwise((strict, *far)):
        assert nearer > (3 if slip else 4) * farther
    assert far[-1] < 1e-5


def test_a_wave_wakes_the_bed() -> None:
    """A push at one end of a bed wakes what is before it frame by frame, and beyond the reach of its beginning."""
    scene = _scene()
    medium = scene.medium
    assert medium is not None
    place, velocities = medium.positions[:, 0], np.array(medium.velocities)
    velocities[place > place.max() - scenes.SPACING] = [-1.0, 0.0, 0.0]
    scene = replace(scene, medium=replace(medium, velocities=velocities))
    _, rollout = _run(scene, SLOW, 6)
    layers = np.floor((place.max() - place) / scenes.SPACING).astype(int)
    awake = [[not asleep[0, layers == layer].any() for layer in range(8)] for asleep in rollout.asleep]
    assert [sum(frame) for frame in awake] == [min(1 + REACH * frame, 8) for frame in range(1, 7)]


@pytest.fixture(
    scope="module",
    params=[
        pytest.param((False, "sand"), id="one-field", marks=pytest.mark.slow),
        pytest.param((True, "sand"), id="two-fields"),
        pytest.param((True, "clay"), id="clay", marks=pytest.mark.slow),
    ],
)
def probed(request: pytest.FixtureRequest) -> tuple[Probe, Gradient, NDArray[np.bool_]]:
    """The cube landing beside matter asleep, with the sleepers of the base point."""
    probe = Probe(_scene(*request.param), 6, fidelity=_fidelity(SLOW))
    return probe, probe.gradient(), probe.rollout.asleep


@pytest.mark.slow  # the conformance suite has it of a robot in the desert
@pytest.mark.parametrize("name", scenes.GROUPS)
def test_gradient_beside_matter_asleep_is_that_of_differences(
    probed: tuple[Probe, Gradient, NDArray[np.bool_]], name: str
) -> None:
    """While the same particles sleep, and some fall asleep and wake on the way."""
    probe, gradient, asleep = probed
    assert 0.1 < asleep.mean() < 0.9
    assert (np.diff(asleep.astype(int), axis=0) > 0).any()
    assert (np.diff(asleep.astype(int), axis=0) < 0).any()
    direction = np.random.default_rng(7).uniform(-1.0, 1.0, probe.base[name].shape)
    # without the adjoint of what sleeps the error is 1e-6 to 1e-5: the robot feels little of it
    assert probe.error(gradient, name, direction, enough=1e-7) <= 1e-7
    np.testing.assert_array_equal(probe.rollout.asleep, asleep)


@pytest.mark.slow  # the conformance suite has the gradient beside matter asleep, in the desert
def test_gradient_is_exact_where_all_matter_wakes_and_another_part_falls_asleep(
    probed: tuple[Probe, Gradient, NDArray[np.bool_]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What one frame leaves of the adjoints at its nodes does not reach the matter asleep in another."""
    probe, _, asleep = probed
    near = np.arange(asleep.shape[2]) < asleep.shape[2] // 2
    chosen = np.zeros_like(asleep)
    chosen[1, 0, near] = chosen[3, 0, ~near] = chosen[4, 0] = True
    monkeypatch.setattr(probe, "replay", replace(probe.rollout, asleep=chosen))
    direction = np.random.default_rng(8).uniform(-1.0, 1.0, probe.base["actuation"].shape)
    assert probe.error(probe.gradient(), "actuation", direction, enough=1e-7) <= 1e-7


def _worlds(transfer: Transfer, slip: bool, **stored: int) -> tuple[Rollout, Gradient]:
    """Two worlds that come to rest first, in which other particles sleep, and their gradient; memory in states."""
    # what slips stirs less of the bed
    fidelity = _fidelity(SLOW / 3 if slip else SLOW, transfer)
    options: dict[str, Any] = {"worlds": 2, "gradients": True}
    scene = _scene(slip)
    if "memory" in stored:
        state = Solver(scene, fidelity, worlds=2).matter.bytes_per_slot()
        stored = {"memory": stored["memory"] * state}
    solver = Solver(scene, fidelity, **options, **stored)
    rest, frames = 2, 4
    actuation = scenes.actuation(solver, frames)
    rollout = solver.run(actuation, equilibration=rest)
    assert not rollout.asleep[:rest].any()
    assert rollout.asleep[-1].any(axis=1).all()
    assert (rollout.asleep[:, 0] != rollout.asleep[:, 1]).any()
    return rollout, solver.backward(rollout, *scenes.path_weights(solver, frames))


@pytest.mark.slow  # the reverse of this scene is compiled for the gradient above alone
@FIELDS
@pytest.mark.parametrize("transfer", ["apic", "aflip"])
def test_gradient_is_the_same_however_little_is_stored(transfer: Transfer, slip: bool) -> None:
    """Bit for bit: what sleeps in a frame sleeps again where the frame is simulated again, or a piece of it."""
    _, expected = _worlds(transfer, slip)
    for name, stored in {**STORED, "less than a frame": {"memory": 24}}.items():
        rollout, found = _worlds(transfer, slip, **stored)
        assert scenes.same(found, expected), name
    assert rollout.segmentation is not None
    assert rollout.segmentation.slots < rollout.counts.max()


def test_a_world_moves_alike_alone_and_beside_others() -> None:
    """Bit for bit, also when its frames are taken one by one."""
    scene, frames = _scene(), 5
    _, pair = _run(scene, SLOW, frames, worlds=2)
    alone = Solver(scene, _fidelity(SLOW))
    play = Playback(alone)
    for frame in range(frames):
        play.frame(pair.actuation[frame, 1:])
        np.testing.assert_array_equal(play.rollout.positions[1, 0], pair.positions[frame + 1, 1])
    assert pair.asleep.any()


@pytest.mark.parametrize("name", ["ground", "water"])
def test_only_solid_media_sleep(name: str) -> None:
    """Nothing else is compiled, and no bit changes, on ground and in water."""
    scene = scenes.SCENES[name]()
    (awake, expected), (solver, found) = (_run(scene, sleep, 2) for sleep in (0.0, SLOW))
    assert solver.launcher.variant == awake.launcher.variant
    assert not found.asleep.size
    np.testing.assert_array_equal(found.positions, expected.positions)


def test_nothing_sleeps_where_all_worlds_are_simulated_at_once() -> None:
    """The driver for many threads compiles what a fidelity without sleep does."""
    (sleeping, awake) = (Solver(_scene(), _fidelity(sleep), parallel=True) for sleep in (SLOW, 0.0))
    assert not sleeping.simulation.sleepers
    assert sleeping.launcher.variant == awake.launcher.variant


@pytest.mark.parametrize("sleep", [-0.1, 1.0, float("nan")])
def test_a_threshold_out_of_range_is_refused(sleep: float) -> None:
    """With the range."""
    with pytest.raises(UsageError, match="between 0 and 1 m/s"):
        _fidelity(sleep)
