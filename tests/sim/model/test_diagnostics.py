"""Every way in which a simulation leaves its range is found within the control frame."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch

from tests.sim import scenes
from tests.sim.test_adjoint import DEAR
from zoobench.errors import Divergence, DivergenceError
from zoobench.sim.model.diagnostics import HeldMatter, Neighbours
from zoobench.sim.model.elastic_bodies import ElasticBody, SceneObject
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.step_limits import choose_step
from zoobench.sim.solver import BodyState, Solver

FRAME = 1e-3
"""One substep per control frame in scenes of the soft cube."""


def _run(scene: Scene, frames: int = 4, frame_seconds: float = FRAME) -> tuple[Solver, Rollout]:
    fidelity = scenes.steady(scene, frame_seconds=frame_seconds)
    solver = Solver(scene, fidelity, frame_seconds=frame_seconds)
    return solver, solver.run(np.zeros((frames, 1, solver.muscle_count)))


def _step() -> float:
    body = scenes.thrown_body()
    return choose_step(scenes.weightless(body), scenes.fidelity(), FRAME, density_ratio_min=0.5).dt


def _fast() -> ElasticBody:
    return scenes.thrown_body(np.array([0.0, 0.0, 0.7 * scenes.SPACING / _step()]))


def _spun() -> ElasticBody:
    rate = 0.8 / _step()
    return scenes.thrown_body(gradient=np.array([[0.0, -rate, 0.0], [rate, 0.0, 0.0], [0.0, 0.0, 0.0]]), cells=1)


def _imploding() -> ElasticBody:
    return scenes.thrown_body(gradient=-1.5 / _step() * np.eye(3))


def _escaping() -> ElasticBody:
    body = scenes.thrown_body(np.array([3.0 * scenes.SPACING / _step(), 0.0, 0.0]))
    return replace(body, positions=body.positions + np.array([0.3, 0.0, 0.0]))


def _overflowing() -> ElasticBody:
    return scenes.thrown_body(np.array([0.0, 1e300, 0.0]))


CASES: dict[str, tuple[Callable[[], ElasticBody], float, str]] = {
    "Courant number": (_fast, 0.5, "smaller Courant fraction"),
    "velocity gradient times dt": (_spun, 1.0, "smaller Courant fraction"),
    "det F": (_imploding, 0.0, "lower the actuation or the muscle strength"),
    "distance beyond the arena in cells": (_escaping, 1.0, "Widen the arena"),
    "finite state": (_overflowing, 0.5, "smaller Courant fraction"),
}


@cache
def _diverged(quantity: str) -> tuple[Solver, Rollout]:
    """The solver and episode of a case."""
    return _run(scenes.weightless(CASES[quantity][0]()))


@pytest.mark.parametrize("quantity", CASES)
def test_divergence_is_found_within_its_frame(quantity: str) -> None:
    """With the quantity, its value and limit, the substep, the particle, its place and advice."""
    _, limit, advice = CASES[quantity]
    solver, rollout = _diverged(quantity)
    found = rollout.divergences[0]
    assert (found.quantity, found.frame, found.world, found.step) == (quantity, 0, 0, 1)
    assert solver.substeps_per_frame == 1
    assert found.limit == limit
    assert found.value < limit if quantity == "det F" else not found.value <= limit
    assert advice in found.advice
    assert f"{quantity} is" in str(found)
    assert f"particle {found.particle}" in str(found)


@pytest.mark.parametrize("quantity", CASES)
def test_path_of_a_diverged_world_repeats_its_last_healthy_state(quantity: str) -> None:
    """No later reader meets a NaN."""
    _, rollout = _diverged(quantity)
    assert np.isfinite(rollout.positions).all()
    assert np.array_equal(rollout.positions[1:], np.repeat(rollout.positions[:1], 4, axis=0))
    assert np.array_equal(rollout.velocities[1:], np.repeat(rollout.velocities[:1], 4, axis=0))


def test_measured_values_are_those_of_the_scene() -> None:
    """Courant number, shear and determinant are reported as they follow from the initial velocity field."""
    found = {name: _diverged(name)[1].divergences[0] for name in CASES}
    assert found["Courant number"].value == pytest.approx(0.7, rel=1e-9)
    assert found["velocity gradient times dt"].value == pytest.approx(0.8 * np.sqrt(2), rel=1e-6)
    assert found["det F"].value == pytest.approx(-0.125, rel=1e-6)


def test_place_is_that_of_the_worst_particle() -> None:
    """Of a body that escapes, the particle farthest out is named, in the coordinates of the arena."""
    found = _diverged("distance beyond the arena in cells")[1].divergences[0]
    cells = (found.place[0] - 0.75) / scenes.SPACING
    assert found.value == pytest.approx(cells, rel=1e-9)
    assert all(0.0 < c < 0.75 for c in found.place[1:])


def test_muscles_far_beyond_the_step_limit_diverge_in_the_frame_that_breaks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that ignores the muscles' stiffness blows up; the frames before stay as they were."""
    weak = scenes.flight_scene(moving=False)
    limit = choose_step(weak, scenes.fidelity(), 0.008, density_ratio_min=0.5)
    monkeypatch.setattr("zoobench.sim.solver.choose_step", lambda *_, **__: limit)
    material = replace(weak.robot.material, muscle_strength=1e6)
    steady = replace(scenes.fidelity(), step=limit.dt)
    solver = Solver(replace(weak, robot=replace(weak.robot, material=material)), steady)
    actuation = np.zeros((8, 1, scenes.MUSCLES))
    actuation[3:] = 1.0
    rollout = solver.run(actuation)
    found = rollout.divergences[0]
    assert found.frame == 3
    assert found.step == 4 * limit.substeps_per_frame
    assert np.isfinite(rollout.positions).all()
    assert np.array_equal(rollout.positions[4:], np.repeat(rollout.positions[3:4], 5, axis=0))


def test_nan_is_found_in_the_frame_that_makes_it() -> None:
    """A tension that overflows turns the state into NaN; the stored trajectory has none."""
    scene = scenes.flight_scene()
    solver = Solver(scene, scenes.steady(scene), worlds=2)
    membership = np.repeat(scene.robot.muscle_membership[None], 2, axis=0)
    membership[1] = 1e303
    actuation = np.zeros((4, 2, scenes.MUSCLES))
    actuation[2:] = 0.5
    rollout = solver.run(actuation, BodyState(muscle_membership=membership))
    assert set(rollout.divergences) == {1}
    found = rollout.divergences[1]
    assert (found.quantity, found.frame, found.step) == ("finite state", 2, 3 * solver.substeps_per_frame)
    assert not np.isfinite(found.value)
    assert bool(torch.isfinite(solver.matter.C[0, 1]).all())
    assert np.isfinite(rollout.positions).all()
    assert np.isfinite(rollout.velocities).all()


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in (*DEAR, "damped", "mire") else ()) for name in scenes.SCENES],
)
def test_healthy_episode_reports_nothing(name: str) -> None:
    """No divergence and no guarded particle in the scenes of these tests."""
    solver = Solver(scenes.SCENES[name](), scenes.fidelity())
    rollout = solver.run(scenes.actuation(solver, 10))
    assert not rollout.divergences
    assert not rollout.guarded.any()


def test_guarded_particles_are_counted() -> None:
    """A body squeezed below the guard of log J counts its particles, though it is not inverted."""
    squeezed = scenes.thrown_body(gradient=-0.7 / _step() * np.eye(3), cells=1)
    solver, rollout = _run(scenes.weightless(squeezed), frames=1)
    assert solver.substeps_per_frame == 1
    # det F = 0.3^3 = 0.027 < 0.05 everywhere; the shear is what is reported
    assert rollout.guarded.tolist() == [squeezed.particle_count]
    assert rollout.divergences[0].quantity == "velocity gradient times dt"


def test_massless_particles_take_no_part() -> None:
    """A particle of occupancy 0 outside the range is no divergence."""
    body = scenes.thrown_body()
    velocities, occupancy = body.velocities.copy(), body.occupancy.copy()
    velocities[5], occupancy[5] = [0.0, 1e6, 0.0], 0.0
    _, rollout = _run(scenes.weightless(replace(body, velocities=velocities, occupancy=occupancy)))
    assert not rollout.divergences


def test_divergence_error_speaks_for_its_divergence() -> None:
    """The error that a method sees carries the divergence and its text."""
    found = Divergence(0, 2, 15, "det F", -0.1, 0.0, 7, (0.1, 0.2, 0.3), "Lower the actuation.")
    error = DivergenceError(found)
    assert error.failure is found
    assert "substep 15 (frame 2, world 0)" in str(error)
    assert "(0.1, 0.2, 0.3) m. Lower the actuation." in str(error)


def test_one_strained_particle_does_not_tear_a_robot() -> None:
    """Its F alone is no sign of a gap: its neighbours have not moved."""
    scene = scenes.weightless(scenes.thrown_body(np.zeros(3)))
    fidelity = scenes.steady(scene, frame_seconds=FRAME)
    start = Solver(scene, fidelity, frame_seconds=FRAME).matter.copy_slot(0)
    start.F[0, 0, 0] = torch.diag(torch.tensor([3.0, 0.6, 0.6], dtype=start.F.dtype))
    solver = Solver(scene, fidelity, frame_seconds=FRAME, start=start)
    rollout = solver.run(np.zeros((1, 1, solver.muscle_count)))
    assert np.linalg.norm(solver.matter.F[0, 0, 0], 2) > 2.0
    assert not rollout.tears


@pytest.mark.parametrize("per_cell", [1, 4, 8, 27])
def test_growth_is_that_of_neighbours(per_cell: int) -> None:
    """A lattice drawn out in x has its ratio; the halves of a body that is cut have the gap's, unless one is absent."""
    rest = fill_box(np.zeros(3), np.full(3, 0.4), 0.1, per_cell)
    present = np.ones(len(rest), bool)
    neighbours = Neighbours(rest, 0.1 / per_cell ** (1 / 3))
    assert neighbours.growth(1.3 * rest, present)[0] == pytest.approx(1.3)
    far = rest[:, 0] > rest[:, 0].mean()
    apart = rest + np.where(far, 0.5, 0.0)[:, None] * np.array([1.0, 0.0, 0.0])
    growth, particle = neighbours.growth(apart, present)
    assert growth > 0.5 / 0.1
    assert abs(rest[particle, 0] - 0.2) < 0.05
    assert neighbours.growth(apart, far)[0] == pytest.approx(1.0)
    assert Neighbours(rest[:1], 0.1).growth(rest[:1], present[:1]) == (1.0, 0)


def test_growths_are_those_of_every_world() -> None:
    """Found for all worlds at once, as on a GPU: the same ratio and particle, absent particles left out."""
    rest = fill_box(np.zeros(3), np.full(3, 0.4), 0.1, 8)
    neighbours = Neighbours(rest, 0.05)
    apart = rest + np.where(rest[:, :1] > 0.2, 0.5, 0.0)
    drawn = np.stack([rest, 1.3 * rest, apart, apart, apart])
    present = np.ones(drawn.shape[:2], bool)
    # of two halves some of one are absent, or all of either
    present[2], present[3], present[4] = rest[:, 0] < 0.3, rest[:, 0] < 0.2, rest[:, 0] > 0.2
    expected = [neighbours.growth(*world) for world in zip(drawn, present, strict=True)]
    found = neighbours.growths(torch.as_tensor(drawn), present)
    assert [ratio for ratio, _ in found] == pytest.approx([ratio for ratio, _ in expected])
    assert found[2][1] == expected[2][1]
    assert Neighbours(rest[:1], 0.1).growths(torch.zeros(2, 1, 3), present[:2, :1]) == [(1.0, 0)] * 2


def test_a_robot_that_parts_without_strain_has_torn() -> None:
    """Two halves that fly apart by more than a cell feel no gradient: only the distances tell."""
    body = scenes.thrown_body(np.zeros(3))
    far = body.positions[:, 0] > body.positions[:, 0].mean()
    scene = scenes.weightless(body)
    fidelity = scenes.steady(scene, frame_seconds=FRAME)
    start = Solver(scene, fidelity, frame_seconds=FRAME).matter.copy_slot(0)
    start.x[0, 0, far, 0] += 3.0 * scenes.SPACING
    solver = Solver(scene, fidelity, frame_seconds=FRAME, start=start)
    rollout = solver.run(np.zeros((1, 1, solver.muscle_count)))
    found = rollout.tears[0]
    assert found.quantity == "distance of neighbours by that at rest"
    assert found.value > found.limit == 4.0
    assert not rollout.divergences


def test_a_base_in_the_ground_or_in_what_is_held_is_found() -> None:
    """By its deepest particle, whose number among the robot's is given; matter that is free does not count."""
    rubber = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0)
    cube = ElasticBody.passive(rubber, fill_box(np.full(3, 0.2), np.full(3, 0.4), 0.1, 8), np.full(64, 0.05**3))
    things = [
        replace(cube, positions=cube.positions + np.array([0.0, 0.3, 0.0])),
        replace(cube, anchor=(((-9.0, -9.0, -9.0), (9.0, 9.0, 9.0)),)),
    ]
    objects = (SceneObject("free", things[0]), SceneObject("held", things[1]))
    robot = ElasticBody.passive(rubber, np.full((1, 3), 0.9), np.array([1e-4]))
    held = HeldMatter(Scene(robot, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), ground=Ground(0.5), objects=objects))
    numbers = np.array([4, 7])
    assert held.entered(np.array([[0.3, 0.6, 0.3], [0.5, 0.01, 0.5]]), numbers) is None
    for place, what in (([0.5, -0.02, 0.5], "ground"), ([0.31, 0.31, 0.31], "held")):
        found = held.entered(np.array([[0.8, 0.8, 0.8], place]), numbers)
        assert found is not None
        assert what in found.quantity
        assert found.particle == 7
        assert found.value > found.limit == 0.0
