"""A film shows the episode that was scored."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from tests.conformance.cells import POND, cell
from tests.render.filmed import CLEAR, SPEC, full_cubes, params, short_film
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.render.film import evenly, film
from zoobench.spec import FRAME_SECONDS, Ref


def test_a_film_shows_what_was_simulated() -> None:
    """Robot, centre of mass, activity and target at its moments are those of the episode with these parameters."""
    shown, problem = short_film(), Problem(SPEC)
    episode = problem.episode(np.array(params()))
    motion = episode.record.motion
    assert shown.evaluation.score == episode.evaluation.score
    np.testing.assert_allclose(shown.times, FRAME_SECONDS * np.array([0, 5, 10]))
    np.testing.assert_allclose(shown.robot, motion.positions[[0, 5, 10], 0], atol=1e-6)
    np.testing.assert_allclose(shown.centre, motion.centre_of_mass()[:, 0])
    np.testing.assert_array_equal(shown.activity[1:], episode.record.actuation[[4, 9]])
    assert not shown.activity[0].any()
    targets = problem.task.targets(motion)  # type: ignore[attr-defined]
    np.testing.assert_allclose(shown.target, targets[:, 0])
    assert shown.medium.shape == (3, problem.scene.particle_count - problem.body.particle_count, 3)
    assert np.abs(shown.medium[2] - shown.medium[0]).max() > 1e-4


def test_a_mixture_with_a_path_shows_its_target() -> None:
    """As the task alone does."""
    spec = replace(SPEC, task=registry.resolve(Kind.TASK, Ref.parse("mix[turning=1.0,waypoint-following=1.0]")))
    mixed = film(spec, params(), moments=[0, 5, 10])
    assert mixed.target is not None
    np.testing.assert_array_equal(mixed.target, short_film().target)


def test_a_particle_shows_the_activity_of_its_muscle() -> None:
    """Weighted by its share; matter without muscle shows none."""
    shown = short_film()
    membership = shown.body.muscle_membership
    assert shown.activation.shape == shown.robot.shape[:2]
    for particle in (0, len(membership) // 2, len(membership) - 1):
        expected = sum(share * shown.activity[1, muscle] for muscle, share in enumerate(membership[particle]))
        assert shown.activation[1, particle] == pytest.approx(expected)


@pytest.mark.slow  # test_recording.py shows it of a picture
def test_a_body_of_a_design_space_has_its_place_to_itself() -> None:
    """Where the workspace is solid no water is shown, and where it is empty there is water."""
    spec = cell(environment=POND.replace("water=grid", "water=particles"), design="particle", frames=1)
    problem = Problem(spec)
    shown = film(spec, problem.initial(np.random.default_rng(0)).tolist())
    assert 0 < shown.body.particle_count < problem.body.particle_count
    water = KDTree(shown.medium[0])
    assert water.query(shown.robot[0][full_cubes(shown)])[0].min() > CLEAR * shown.particle_edge
    place = shown.scene.robot.positions[0] - shown.body.positions[0]
    empty = problem.body.positions[KDTree(shown.body.positions).query(problem.body.positions)[0] > 1e-6]
    assert water.query(empty + place)[0].max() < 1.2 * shown.particle_edge


def test_parameters_of_another_body_are_refused() -> None:
    """The message names both counts."""
    with pytest.raises(UsageError, match=f"has 3 parameters.*{len(params())}"):
        film(SPEC, (0.0, 1.0, 2.0))


def test_a_film_that_no_memory_holds_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before it is simulated, with what to keep of it: no more than is advised where more were asked for."""
    monkeypatch.setattr("zoobench.render.film._LARGEST", 10_000)
    advised = []
    for every in (1, 3):
        with pytest.raises(UsageError, match=r"Keep fewer, as `zoobench render --every \d+` does\.") as error:
            film(SPEC, params(), moments=range(0, SPEC.frames + 1, every))
        advised.append(int(str(error.value).split("--every ")[1].split("`")[0]))
    assert 3 < advised[0] <= advised[1]


def test_moments_are_spread_from_start_to_end() -> None:
    """A short episode has fewer than were asked for."""
    assert evenly(200, 6) == [0, 40, 80, 120, 160, 200]
    assert evenly(2, 6) == [0, 1, 2]
