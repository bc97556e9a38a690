"""An object that falls before the episode is no object of it: the run fails with the reason."""

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench.cell.object_rest import object_fault
from zoobench.cell.problem import Problem
from zoobench.errors import Displaced, SceneError
from zoobench.methods.base import Incumbent
from zoobench.sim.model.scene import Scene
from zoobench.testing import DOUBLE

ON_A_BACK = "ground[object=box,object_place=back]"


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A robot with two boxes ahead of it."""
    return Problem(cell(environment="ground[object=box,object_count=2]", task="push")).scene


def _turned(degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("way", "degrees", "is_there"),
    [
        ((0.0, 0.0, 0.0), 0.0, True),
        ((0.003, -0.01, -0.003), 20.0, True),
        ((0.0, 0.0, 0.02), 0.0, False),
        ((0.0, -0.04, 0.0), 0.0, False),
        ((0.0, 0.0, 0.0), -40.0, False),
        ((0.0, 0.0, 0.0), 180.0, False),
    ],
)
@pytest.mark.parametrize("name", ["object", "object-1"])
def test_every_object_must_be_where_it_was_put(
    scene: Scene, name: str, way: tuple[float, float, float], degrees: float, is_there: bool
) -> None:
    """But for what it sinks and turns as the ground or the back gives way."""
    positions, own = scene.elastic.positions.copy(), scene.slice_of(name)
    centre = positions[own].mean(axis=0)
    positions[own] = (positions[own] - centre) @ _turned(degrees).T + centre + way
    fault = object_fault(scene, positions)
    assert bool(fault) == (not is_there)
    if fault:
        assert f"The {name} does not stay where it was put" in fault
        assert f"goes {1e3 * np.linalg.norm(way):.1f} mm and turns by {abs(degrees):.0f} degrees" in fault


def test_a_robot_that_cannot_carry_its_object_is_refused() -> None:
    """A box tips over an edge, before anything is scored; in a session, too."""
    spec = cell(
        environment="ground[object=box,object_place=back,object_shift=0.04]",
        task="carry",
        design="caterpillar",
        fidelity=DOUBLE,
    )
    problem = Problem(spec)
    for ask in (lambda: problem.evaluate(np.zeros(problem.parameter_count)), lambda: problem.solvers.new(2)):
        with pytest.raises(SceneError, match="The object does not stay where it was put"):
            ask()


@pytest.mark.slow
def test_a_body_of_a_space_that_cannot_fails_alone() -> None:
    """Without a score, as one that cannot be built: others may be able to. A checkpoint knows the reason."""
    problem = Problem(cell(environment=ON_A_BACK, task="carry", design="voxel", fidelity=DOUBLE))
    params = problem.initial(np.random.default_rng(0))
    evaluation = problem.evaluate(params)
    assert evaluation.score == -np.inf
    assert isinstance(evaluation.failure, Displaced)
    incumbent = Incumbent()
    incumbent.offer(params, evaluation)
    assert Incumbent.from_state(incumbent.state()).last_failure == evaluation.failure


@pytest.mark.parametrize(
    ("env", "task", "design", "most"),
    [
        ("ground[object=box]", "push", "caterpillar", 1e-3),
        ("ground[object=ball]", "kick", "caterpillar", 1e-3),
        ("ground[object=column,object_size=0.16]", "topple", "caterpillar", 1e-3),
        # it bounces
        ("ground[object=ball,object_gap=0.15,object_speed=0.6,object_speed_up=1.2]", "catch", "block", 4e-3),
    ],
)
def test_a_robot_at_rest_scores_nothing(env: str, task: str, design: str, most: float) -> None:
    """Less than what docs/guide/objects.md says [m, rad]: the object stays, but for one that is thrown."""
    problem = Problem(cell(environment=env, task=task, design=design, frames=100, fidelity=DOUBLE))
    evaluation = problem.evaluate(np.zeros(problem.parameter_count))
    assert evaluation.failure is None
    assert abs(evaluation.score) < most


def test_a_thrown_object_flies_as_it_was_thrown(monkeypatch: pytest.MonkeyPatch) -> None:
    """From rest on the ground, once everything has come to rest: as high as g lets it, and as far in that time."""
    monkeypatch.setattr("zoobench.sim.rest.MOST_ROUNDS", 0)
    spec = cell(
        environment="ground[object=box,object_gap=0.1,object_speed=0.5,object_speed_up=1]",
        task="catch",
        frames=12,
        fidelity=DOUBLE,
    )
    problem = Problem(spec)
    record = problem.episode(np.zeros(problem.parameter_count)).record
    assert record is not None
    centre = record.motion.object.centre_of_mass()[:, 0].numpy()
    times = 0.008 * np.arange(13)
    np.testing.assert_allclose(centre[:, 0] - centre[0, 0], -0.5 * times, atol=0.002)
    np.testing.assert_allclose(centre[:, 1] - centre[0, 1], times - 0.5 * 9.81 * times**2, atol=0.002)
