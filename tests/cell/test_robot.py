"""Robots as functions of parameters, with fixed bodies and design spaces."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.conformance.cells import POND, SEA, cell
from zoobench import registry
from zoobench.cell.episode_runner import EpisodeRunner
from zoobench.cell.meter import BudgetMeter
from zoobench.cell.problem import Problem
from zoobench.cell.robot import Robot, elongation
from zoobench.designs.base import Body
from zoobench.designs.block import Block
from zoobench.errors import DivergenceError, SceneError, Unbuildable, UsageError
from zoobench.methods.base import Incumbent
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref
from zoobench.testing import DOUBLE

TIMES = torch.arange(4, dtype=torch.float64) * 0.008


def _robot(design: str) -> Robot:
    return Robot.of(Ref.parse(design), Ref("sine-basis"), Fidelity(1 / 32), Ref("turning"))


def _empty(problem: Problem) -> np.ndarray:
    """Parameters of an empty body of a voxel space."""
    parameters = problem.initial(np.random.default_rng(0))
    parameters[problem.robot.control_count :] = -30.0
    return parameters


def test_a_fixed_body_takes_a_controller_alone() -> None:
    """All parameters are the controller's, and the simulator's arrays are unchanged."""
    robot = _robot("caterpillar")
    draw = robot.initial(np.random.default_rng(0))
    draft = robot.draft(torch.as_tensor(draw)[None], TIMES)
    assert robot.parameter_count == robot.control_count == len(draw)
    assert not draft.fault
    for built in (draft.solid(), draft.relaxed()):
        assert built.body is robot.body
        assert (built.matter, built.metrics) == ({}, {})


@pytest.mark.parametrize("environment", [SEA, "ground"])
def test_the_robot_of_a_run_is_the_one_that_was_simulated(environment: str) -> None:
    """With as many parameters: in water by forces on the surface thin parts have fewer particles."""
    spec = cell(environment=environment, design="voxel[base=clownfish,optimise=geometry]")
    assert Robot.of_run(spec).parameter_count == Problem(spec, worlds=1).parameter_count


def test_muscles_come_in_over_the_onset() -> None:
    """From none at the beginning, by half after half of the time, and as asked for from then on."""
    asked = _robot("caterpillar")
    draw = torch.as_tensor(asked.initial(np.random.default_rng(0)))[None]
    times = torch.tensor([0.0, 0.1, 0.2, 0.3], dtype=torch.float64)
    full, less = (replace(asked, onset=onset).draft(draw, times).activity for onset in (0.0, 0.2))
    assert full.any(dim=2).all()
    torch.testing.assert_close(less, full * torch.tensor([0.0, 0.5, 1.0, 1.0])[:, None, None], rtol=1e-12, atol=0.0)


def test_a_design_space_adds_its_parameters_after_the_controllers() -> None:
    """The controller's draw is the same as without it; with zeros no muscle is active."""
    fixed, free = _robot("block"), _robot("voxel")
    draw = free.initial(np.random.default_rng(0))
    assert len(draw) == free.parameter_count > free.control_count == fixed.parameter_count
    np.testing.assert_array_equal(draw[: free.control_count], fixed.initial(np.random.default_rng(0)))
    still = np.concatenate([np.zeros(free.control_count), draw[free.control_count :]])
    moving, resting = (free.draft(torch.as_tensor(row)[None], TIMES).solid() for row in (draw, still))
    assert moving.activity.any()
    assert not resting.activity.any()
    np.testing.assert_array_equal(moving.body.positions, resting.body.positions)
    assert moving.metrics["body_volume"].value == pytest.approx(moving.body.volumes.sum())


@pytest.mark.parametrize("design", ["voxel", pytest.param("sdf-lerp", marks=pytest.mark.slow)])
def test_the_solid_body_is_whole_particles_where_the_form_is_solid(design: str) -> None:
    """Nothing of half-empty sites is left, and what is left has its full mass, stiffness and strength."""
    robot = _robot(design)
    draw = robot.initial(np.random.default_rng(3))
    form = robot.space.form(torch.as_tensor(draw)[None, robot.control_count :], robot.body)  # type: ignore[union-attr]
    occupancy = form.occupancy[0].numpy()
    assert ((occupancy > 0.01) & (occupancy < 0.5)).any(), "a form with haze"
    body = robot.formed(draw)
    built = (robot.body.positions[:, None] == body.positions).all(axis=2).any(axis=1)
    assert (occupancy[built] > 0.5).all()
    assert built.sum() == body.particle_count > 0
    assert (body.occupancy == 1.0).all()
    np.testing.assert_array_equal(body.muscle_membership, form.muscle_membership[0].numpy()[built])
    relaxed = robot.draft(torch.as_tensor(draw)[None], TIMES).relaxed().body
    assert relaxed.particle_count < robot.body.particle_count or design == "voxel", "empty sites are not simulated"
    assert relaxed.occupancy.min() > 0.0


def test_thin_matter_is_left_out_in_the_rest_frame() -> None:
    """It would be turned inside out by the matter that it hangs on."""
    problem = Problem(cell(environment=SEA, design="voxel", frames=20))
    draw = problem.initial(np.random.default_rng(1))
    draft = problem.robot.draft(torch.as_tensor(draw)[None], TIMES)
    assert draft.form is not None
    assert (draft.form.occupancy[0].numpy() < 0.3)[~draft.existing].all()
    assert draft.relaxed().body.occupancy.min() > 0.3


@pytest.mark.slow
def test_a_body_without_its_thin_matter_lives_in_the_rest_frame() -> None:
    """The same body, whose thin matter was turned inside out."""
    problem = Problem(cell(environment=SEA, design="sdf-lerp", fidelity="draft", frames=20))
    assert problem.relaxed(problem.initial(np.random.default_rng(1))).evaluation.failure is None


def test_a_form_without_head_has_an_end_for_it() -> None:
    """Matter in the middle alone: its foremost particles are the head, its last ones the tail."""
    robot = _robot("particle")
    rows = robot.initial(np.random.default_rng(0))[robot.control_count :].reshape(robot.body.particle_count, -1)
    rows[:, 0] = np.where(np.abs(robot.body.positions[:, 0]) < 0.03, 1.0, -1.0)
    body = robot.formed(np.concatenate([np.zeros(robot.control_count), rows.ravel()]))
    along = body.positions[:, 0]
    assert along[body.head].min() == along.max()
    assert along[body.tail].max() == along.min()


def test_scarce_matter_is_soft_and_weak() -> None:
    """Elastic and active stress fall with the third power of the occupancy, one power by the volume."""
    robot = _robot("voxel")
    built = robot.draft(torch.as_tensor(robot.initial(np.random.default_rng(0)))[None], TIMES).relaxed()
    share = built.matter["occupancy"][0]
    torch.testing.assert_close(built.matter["muscle_membership"][0].sum(dim=1), share**2)
    assert (built.matter["stiffness"][0] <= share**2).all()


@pytest.mark.slow
def test_stiffness_is_a_share_of_the_workspaces() -> None:
    """The stiffest tissue of the primitives has its stiffness in forms and in built bodies, too."""
    robot = _robot("sdf-lerp")
    draw = robot.initial(np.random.default_rng(0))
    draft = robot.draft(torch.as_tensor(draw)[None], TIMES)
    form = robot.space.form(torch.as_tensor(draw)[None, robot.control_count :], robot.body)  # type: ignore[union-attr]
    assert robot.body.stiffness.max() == 2.0
    relaxed = draft.relaxed().matter
    kept = torch.as_tensor(draft.existing)
    torch.testing.assert_close(relaxed["stiffness"], 2.0 * form.stiffness[:, kept] * relaxed["occupancy"] ** 2)
    solid = draft.solid().body
    built = (robot.body.positions[:, None] == solid.positions).all(axis=2).any(axis=1)
    np.testing.assert_allclose(solid.stiffness, 2.0 * form.stiffness[0].numpy()[built])


@pytest.mark.parametrize(
    "env", [pytest.param("ground", id="land"), pytest.param(POND, id="water", marks=pytest.mark.slow)]
)
def test_the_scored_body_is_the_one_that_is_shown(env: str) -> None:
    """The formed body as a fixed design has the score of the solution, bit for bit; equilibration is counted apart."""
    problem = Problem(cell(environment=env, design="voxel", frames=4, fidelity=DOUBLE))
    draw = problem.initial(np.random.default_rng(2))
    scored = problem.evaluate(draw)
    environment = registry.create(Kind.ENV, problem.spec.env)
    shown = EpisodeRunner(
        environment, problem.task, problem.robot, problem.fidelity, BudgetMeter(),
        body=problem.robot.formed(draw), frames=4, is_fixed=True,
    )  # fmt: skip
    times = torch.arange(4, dtype=torch.float64) * 0.008
    (again,) = shown.run([problem.robot.draft(torch.as_tensor(draw)[None], times).solid()])
    assert again.evaluation.score == scored.score
    assert problem.meter.forward > 0
    # water on a grid is at rest from the beginning
    assert (problem.meter.equilibration > problem.meter.forward) == bool(environment.equilibration_frames)


def test_a_design_that_cannot_be_built_is_explained_and_charged() -> None:
    """No score and no gradient, but the cost of an episode; other designs are unaffected."""
    problem = Problem(cell(design="voxel", frames=3))
    whole = problem.initial(np.random.default_rng(0))
    (bad, bad_gradient), (good, gradient) = problem.loss_and_grad_batch([_empty(problem), whole])
    alone = Problem(cell(design="voxel", frames=3)).loss_and_grad(whole)
    assert isinstance(bad.failure, Unbuildable)
    assert "empty" in str(bad.failure)
    assert bad.score == -math.inf
    assert np.isnan(bad_gradient).all()
    assert (good.failure, good.score) == (None, alone[0].score)
    np.testing.assert_array_equal(gradient, alone[1])
    assert {"body_volume", "components", "mass_kept"} <= set(good.metrics)
    assert problem.meter.episodes == 2
    only = Problem(cell(design="voxel", frames=3))
    only.evaluate(_empty(only))
    assert (only.meter.forward, only.meter.substeps) == (only.substeps_per_episode, only.substeps_per_episode)
    only.loss_and_grad(_empty(only))
    assert only.meter.substeps == 4 * only.substeps_per_episode, "as much as a gradient was expected to cost"
    only.meter.costliest = only.substeps_per_episode + 5
    only.evaluate(_empty(only))
    assert only.meter.substeps == 5 * only.substeps_per_episode + 5, (
        "what is expected is learnt from what was simulated"
    )


def test_a_run_whose_designs_all_fail_says_why() -> None:
    """The incumbent's error is that of the last design, also after a checkpoint."""
    problem = Problem(cell(design="voxel", frames=3))
    incumbent = Incumbent()
    incumbent.offer(_empty(problem), problem.evaluate(_empty(problem)))
    with pytest.raises(DivergenceError, match="cannot be built"):
        Incumbent.from_state(incumbent.state()).solution()


@pytest.mark.parametrize(
    "names",
    [
        pytest.param({"controller": "sine-feedback"}, id="feedback"),
        pytest.param({"design": "voxel"}, id="bodies", marks=pytest.mark.slow),
        pytest.param(
            {"design": "voxel", "environment": POND, "fidelity": DOUBLE}, id="bodies in water", marks=pytest.mark.slow
        ),
    ],
)
def test_worlds_do_not_disturb_each_other(names: dict[str, str]) -> None:
    """Scores and gradients of robots side by side are those of each robot alone, bit for bit."""
    problem = Problem(cell(frames=6 if "controller" in names else 3, **names))  # type: ignore[arg-type]
    draws = [problem.initial(np.random.default_rng(seed)) for seed in range(2)]
    together = problem.loss_and_grad_batch(draws)
    for draw, (evaluation, gradient) in zip(draws, together, strict=True):
        alone, alone_gradient = problem.loss_and_grad(draw)
        assert alone.score == evaluation.score
        np.testing.assert_array_equal(alone_gradient, gradient)


def test_elongation_tells_needles_from_balls() -> None:
    """Of rotated boxes, whose deviations are proportional to their edges, with weights."""
    grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 5)] * 3), axis=-1).reshape(-1, 3)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    ones = np.ones(len(grid))
    assert elongation(grid @ turn, ones) == pytest.approx(0.0, abs=1e-9)
    assert elongation(grid * (4.0, 1.0, 0.5) @ turn + 3.0, ones) == pytest.approx(0.75)
    assert elongation(grid * (4.0, 4.0, 1.0), ones) == pytest.approx(0.0, abs=1e-9)
    assert elongation(grid * (1.0, 0.0, 0.0), ones) == pytest.approx(1.0)
    assert elongation(np.vstack([grid, 9.0 * grid[:4]]), np.append(ones, np.zeros(4))) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("end", ["head", "tail"])
@pytest.mark.parametrize("space", [False, True])
def test_a_body_without_a_head_or_a_tail_is_refused(end: str, space: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever made it, a plug-in or the base of a space: it would have no heading, and its scores would be NaN."""

    def headless(self: Block, fidelity: Fidelity) -> Body:
        body = sampled(self, fidelity)
        return replace(body, **{end: np.zeros(body.particle_count, bool)})

    sampled = Block.body
    monkeypatch.setattr(Block, "body", headless)
    with pytest.raises(SceneError, match=f"no particle in its {end}"):
        Problem(cell(design="voxel[edge=0.013]" if space else "block[length=0.101]"))  # bodies made before are kept
    monkeypatch.setattr(Block, "body", lambda *given: replace(sampled(*given), **{end: np.ones(3, bool)}))
    with pytest.raises(SceneError, match=r"shape \(3,\)"):
        _robot("block[length=0.101]")


def test_only_a_space_with_sites_can_be_painted_on() -> None:
    """A fixed body and a network are refused, with the designs to choose."""
    assert _robot("voxel").site_space is not None
    for design in ("caterpillar", "implicit"):
        with pytest.raises(UsageError, match="--design particle or --design voxel"):
            _ = _robot(design).site_space
