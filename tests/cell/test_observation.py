"""Observations."""

import math

import numpy as np
import pytest
import torch

from zoobench import registry
from zoobench.cell.observation import ObservationModel, layout_of
from zoobench.designs.caterpillar import Caterpillar
from zoobench.registry import Kind
from zoobench.sim.model.elastic_bodies import ElasticBody, SceneObject
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.spec import FRAME_SECONDS, Ref
from zoobench.tasks.paths import Path

BODY = Caterpillar().body(Fidelity(1 / 64))
REST = torch.as_tensor(BODY.positions)
WHOLE = torch.ones(BODY.particle_count, dtype=torch.float64)
LENGTH = float(np.ptp(BODY.positions[:, 0]))
BLIND = ObservationModel(BODY, None, 1)
FRAMES = 200
MIX = "mix[turning=1,waypoint-following=2]"
ADDED = {
    "final-position": ("target_position",),
    MIX: ("waypoint_following_target_position", "waypoint_following_target_velocity"),
    "movement-speed": ("target_direction",),
    "turning": (),
    "velocity-tracking": ("target_velocity",),
    "waypoint-following": ("target_position", "target_velocity"),
}
"""What the tasks add to an observation, two numbers each."""


def _added(task: str, frame: int, positions: torch.Tensor, start: torch.Tensor = REST) -> torch.Tensor:
    """What follows the body's numbers in an observation of a body without velocity."""
    model = ObservationModel(BODY, registry.create(Kind.TASK, Ref.parse(task)), FRAMES)
    seen = model.observe(frame, positions, torch.zeros_like(REST), start, WHOLE)
    assert len(seen) == model.count
    blind = BLIND.observe(frame, positions, torch.zeros_like(REST), start, WHOLE)
    assert torch.equal(seen[: BLIND.count], blind)
    return seen[BLIND.count :]


def _turn(angle: float) -> torch.Tensor:
    """Counter-clockwise seen from above, by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)


def test_a_body_at_rest_observes_its_heading_only() -> None:
    """Zeros, and a heading of 1 and 0."""
    seen = BLIND.observe(0, REST, torch.zeros_like(REST), REST, WHOLE).numpy()
    assert len(seen) == BLIND.count == 8 + 6 * BODY.muscle_count
    assert seen[6:8] == pytest.approx([1.0, 0.0], abs=1e-9)
    assert np.delete(seen, [6, 7]) == pytest.approx(0.0, abs=1e-9)


def test_a_rigid_rotation_changes_heading_and_displacement_only() -> None:
    """Velocities and muscles are observed in the body's frame."""
    rng = np.random.default_rng(0)
    positions = REST + torch.as_tensor(0.002 * rng.normal(size=REST.shape))
    velocities = torch.as_tensor(0.1 * rng.normal(size=REST.shape))
    turn = _turn(0.7)
    before = BLIND.observe(0, positions, velocities, positions, WHOLE)
    after = BLIND.observe(0, positions @ turn.T, velocities @ turn.T, positions @ turn.T, WHOLE)
    np.testing.assert_allclose(after[[0, 1, 2]], before[[0, 1, 2]], atol=1e-9)
    np.testing.assert_allclose(after[8:], before[8:], atol=1e-9)
    angles = [math.atan2(float(seen[7]), float(seen[6])) for seen in (before, after)]
    assert angles[1] - angles[0] == pytest.approx(0.7, abs=1e-6)


def test_velocity_and_displacement_are_those_of_the_centre_of_mass() -> None:
    """In units of the body length L and of 20 L/s; muscles do not observe a common motion."""
    shift = torch.tensor([0.03, 0.01, -0.02], dtype=torch.float64)
    seen = BLIND.observe(0, REST + shift, torch.zeros_like(REST) + shift, REST, WHOLE).numpy()
    assert seen[:3] == pytest.approx(shift.numpy() / (20.0 * LENGTH))
    assert seen[3:6] == pytest.approx(shift.numpy() / LENGTH)
    assert seen[8:] == pytest.approx(0.0, abs=1e-9)


def test_empty_particles_are_not_observed() -> None:
    """A particle without occupancy may be anywhere, and an empty muscle is at rest."""
    gone = torch.as_tensor((BODY.muscle_membership[:, 0] == 0.0).astype(np.float64))
    wild = torch.where(gone[:, None] > 0, REST, 1e3 * torch.ones_like(REST))
    seen = BLIND.observe(0, wild, torch.zeros_like(REST), REST, gone)
    assert torch.isfinite(seen).all()
    np.testing.assert_allclose(seen, BLIND.observe(0, REST, torch.zeros_like(REST), REST, gone), atol=1e-9)


def test_the_derivative_is_right_on_a_robot_that_stands_on_its_head() -> None:
    """It is finite where the horizontal heading has no direction."""
    stand = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    positions = (REST @ stand.T).requires_grad_()
    seen = BLIND.observe(0, positions, torch.zeros_like(REST), REST, WHOLE)
    (gradient,) = torch.autograd.grad(seen.sum(), positions)
    assert torch.isfinite(gradient).all()


@pytest.mark.parametrize("task", ADDED)
def test_a_task_adds_what_it_is_about_and_the_time_left(task: str) -> None:
    """The same state differs between tasks; the layout names the parts and their lengths."""
    added = registry.create(Kind.TASK, Ref.parse(task))
    names = [name for name, _ in layout_of(BODY.muscle_count, added)]
    assert names == ["body", "muscles", *ADDED[task], "time_left"]
    assert len(_added(task, 0, REST)) == 2 * len(ADDED[task]) + 1


def test_a_task_that_says_nothing_adds_the_time_left() -> None:
    """A plug-in may leave the observation out; the share of the episode that is left falls from 1 to 0."""
    seen = [
        ObservationModel(BODY, object(), FRAMES).observe(frame, REST, torch.zeros_like(REST), REST, WHOLE)  # type: ignore[arg-type]
        for frame in (0, 50, FRAMES)
    ]
    assert [len(one) for one in seen] == [BLIND.count + 1] * 3
    assert [float(one[-1]) for one in seen] == [1.0, 0.75, 0.0]


def _box(place: tuple[float, float, float]) -> SceneObject:
    """A small box at a place [m]."""
    lattice = np.indices((3, 3, 3)).reshape(3, -1).T * 0.01
    body = ElasticBody.passive(ElasticMaterial(1e5, 0.3, 600.0), lattice + place, np.full(27, 1e-6))
    return SceneObject("object", body)


def test_an_object_is_seen_from_the_turned_robot() -> None:
    """Its place, its velocity and its axes, and where it is to go, in closed form; its particles follow the robot's."""
    thing, angle = _box((0.2, 0.0, 0.1)), 0.7
    model = ObservationModel(BODY, registry.create(Kind.TASK, Ref.parse("push-to[x=0.3,z=0.1]")), FRAMES, (thing,))
    start = torch.cat([REST, torch.as_tensor(thing.body.positions)])
    way, speed = torch.tensor([0.02, 0.01, -0.03]).double(), torch.tensor([0.4, 0.1, 0.2]).double()
    moved = torch.cat([REST @ _turn(angle).T, torch.as_tensor(thing.body.positions) + way])
    velocities = torch.cat([torch.zeros_like(REST), speed.expand(27, 3)])
    seen = model.observe(50, moved, velocities, start, WHOLE).numpy()
    assert len(seen) == model.count
    assert model.layout[2:-1] == (
        ("object_place", 3), ("object_velocity", 3), ("object_axes", 6), ("target_position", 2)
    )  # fmt: skip
    view = np.array([[math.cos(angle), 0, -math.sin(angle)], [0, 1, 0], [math.sin(angle), 0, math.cos(angle)]])
    centre = (torch.as_tensor(BODY.masses(1.0)) @ REST / BODY.masses(1.0).sum()) @ _turn(angle).T
    middle = thing.body.positions.mean(axis=0) + way.numpy()
    expected = [
        *(view @ (middle - centre.numpy()) / LENGTH),
        *(view @ speed.numpy() / (20.0 * LENGTH)),
        *view[:, 0], *view[:, 1],
        *(view[::2] @ [0.28, 0.0, 0.13] / LENGTH),
        0.75,
    ]  # fmt: skip
    np.testing.assert_allclose(seen[BLIND.count :], expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(
        seen[: BLIND.count], BLIND.observe(50, moved[: len(REST)], 0.0 * REST, REST, WHOLE).numpy()
    )


@pytest.mark.parametrize("task", ["movement-speed", "velocity-tracking", "waypoint-following"])
def test_a_target_is_seen_from_the_turned_and_displaced_robot(task: str) -> None:
    """Components ahead and right of a heading 0.7 rad to the left, in closed form."""
    frame, angle, shift = 150, 0.7, torch.tensor([0.03, 0.01, -0.02], dtype=torch.float64)
    centre = torch.as_tensor(BODY.masses(1.0)) @ REST / BODY.masses(1.0).sum()
    positions = (REST - centre) @ _turn(angle).T + centre + shift
    seen = _added(task, frame, positions).numpy()
    ahead, right = [math.cos(angle), 0.0, -math.sin(angle)], [math.sin(angle), 0.0, math.cos(angle)]
    path, time = Path("arc", 0.05), np.array([frame * FRAME_SECONDS])
    vectors = {
        "target_direction": np.array([1.0, 0.0, 0.0]),
        "target_position": (path.positions(time)[0] - shift.numpy()) / LENGTH,
        "target_velocity": path.velocities(time)[0] / LENGTH,
    }
    expected = [side @ vectors[name] for name in ADDED[task] for side in (ahead, right)]
    np.testing.assert_allclose(seen, [*expected, 0.25], rtol=1e-6)


def test_a_target_to_the_left_is_not_to_the_right() -> None:
    """The arc turns left, so that after a while the target is left of a robot that has not moved."""
    place, velocity = _added("waypoint-following", 150, REST)[:4].reshape(2, 2)
    assert place[0] > 0.0 > place[1]
    assert velocity[0] > 0.0 > velocity[1]


def test_numbers_of_a_target_are_of_order_one() -> None:
    """For a caterpillar that stays where it is, over a standard episode."""
    seen = torch.stack([_added("waypoint-following[path=s-curve]", frame, REST) for frame in range(0, 200, 20)])
    largest = seen.abs().amax(dim=0)
    assert (largest > 0.1).all()
    assert (largest < 3.0).all()


@pytest.mark.parametrize("task", ["movement-speed", "velocity-tracking", "waypoint-following"])
def test_the_derivative_by_the_state_is_that_of_differences(task: str) -> None:
    """Through centre of mass and heading, by position and occupancy, of a body that is bent and turned."""
    rng = np.random.default_rng(3)
    places = (REST + torch.as_tensor(0.004 * rng.normal(size=REST.shape))) @ _turn(0.4).T
    model = ObservationModel(BODY, registry.create(Kind.TASK, Ref(task)), FRAMES)
    weights = torch.as_tensor(rng.normal(size=model.count))
    weights[: BLIND.count] = 0.0
    ways = [torch.as_tensor(rng.normal(size=shape)) for shape in (REST.shape, WHOLE.shape)]

    def value(positions: torch.Tensor, occupancy: torch.Tensor) -> torch.Tensor:
        return model.observe(70, positions, torch.zeros_like(REST), REST, occupancy) @ weights

    def shifted(step: float) -> float:
        return float(value(places + step * LENGTH * ways[0], 0.8 * WHOLE + step * ways[1]))

    leaves = [places.clone().requires_grad_(), (0.8 * WHOLE).requires_grad_()]
    gradients = torch.autograd.grad(value(*leaves), leaves)
    along = float((gradients[0] * ways[0]).sum() * LENGTH + gradients[1] @ ways[1])
    assert along == pytest.approx((shifted(1e-6) - shifted(-1e-6)) / 2e-6, rel=1e-6)
    assert gradients[0].any()
