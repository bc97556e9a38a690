"""What every registered component owes, whoever wrote it. A new component is tested by being registered."""

import inspect
import itertools
import re

import numpy as np
import pytest
import torch

from tests.conformance.cells import POND, cell
from tests.methods.toy import Context
from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.controllers.base import Controller, OpenLoop
from zoobench.inputs import InputFile, StoredRun
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import PARTICLES_PER_CELL, Fidelity
from zoobench.spec import FRAME_SECONDS, Budget, Ref

ENVS, TASKS, DESIGNS, CONTROLLERS, METHODS, FIDELITIES = (registry.names(kind) for kind in Kind)
TASKS = [name if name != "mix" else "mix[movement-speed=1,turning=0.2,final-position=0.1]" for name in TASKS]
# what a user's file makes is tested with files, in tests/designs
DESIGNS = [name for name in DESIGNS if not registry.get(Kind.DESIGN, name).required]
# a stored gait is tested with stored runs, in tests/controllers
CONTROLLERS = [name for name in CONTROLLERS if not registry.get(Kind.CONTROLLER, name).required]

# an agent of a user's file is tested with files, in tests/methods
METHODS = [name for name in METHODS if not registry.get(Kind.METHOD, name).required]


def _is_fast(env: str, task: str, design: str) -> bool:
    """The caterpillar everywhere and in every task, but not all pairs; any other body once.

    Bodies move on land, or in the pond below if they belong into water. All of the product is for `-m slow`.
    """
    if design == "caterpillar":
        return task == "movement-speed" or env in ("ground", "ocean")
    return task == "movement-speed" and env == "ground" and design not in SWIMMERS


SWIMMERS = [name for name in DESIGNS if "water" in registry.get(Kind.DESIGN, name).tags]
CELLS = [
    pytest.param(*names, marks=() if _is_fast(*names) else pytest.mark.slow)
    for names in itertools.product(ENVS, TASKS, DESIGNS)
]
CELLS += [
    pytest.param(POND, "movement-speed", name, id=f"pond-movement-speed-{name}")
    for name in (*SWIMMERS, "voxel")  # and a design space in water
]
SEEN = 30
"""Length of the observations that closed loops are given here."""

DOUBLE = "smoke[precision=64]"
"""Of all tests with a gradient, whose kernels take far longer to compile than to run."""

ALL = [(kind, name) for kind in Kind for name in registry.names(kind)]


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_it_is_documented_and_has_only_optional_parameters(kind: Kind, name: str) -> None:
    """A first line for `zoobench list`, and defaults for everything but a user's file or run, so that the name runs."""
    component = registry.get(kind, name)
    assert len(component.summary) > 10
    assert all(component.parameters[name] in (InputFile, StoredRun) for name in component.required)
    for parameter in inspect.signature(component.factory).parameters.values():
        assert parameter.kind is parameter.KEYWORD_ONLY
        assert parameter.name in component.parameters.keys() | component.groups.keys()


@pytest.mark.parametrize("name", ENVS)
def test_an_environment_tells_the_unit_of_every_number(name: str) -> None:
    """Each parameter has a line of its own in what `zoobench show` prints, numbers with a unit in brackets."""
    component = registry.get(Kind.ENV, name)
    lines = [f"*{item}" for item in " ".join(component.description.split()).split(" * ")]
    for key, expected in component.parameters.items():
        (told,) = (line for line in lines if f"`{key}`" in line.partition(":")[0])
        assert expected in (int, bool) or re.search(r"\[[^]]+\]", told), told


@pytest.mark.parametrize("name", FIDELITIES)
def test_a_fidelity_is_what_it_says(name: str) -> None:
    """Every knob can be turned by its name."""
    fidelity = registry.create(Kind.FIDELITY, Ref.parse(f"{name}[precision=64,grid_spacing=0.01,courant=0.3]"))
    assert (fidelity.precision, fidelity.grid_spacing, fidelity.courant) == (64, 0.01, 0.3)


@pytest.mark.parametrize("name", DESIGNS)
def test_a_body_is_whole(name: str) -> None:
    """It stands on its ground point, muscles are named and used, head and tail exist, mass is that of a finer body."""
    design = registry.create(Kind.DESIGN, Ref(name))
    fine = design.body(Fidelity(1 / 64, particles_per_cell=PARTICLES_PER_CELL[-1]))
    for particles_per_cell in PARTICLES_PER_CELL:
        body = design.body(Fidelity(1 / 64, particles_per_cell=particles_per_cell))
        assert body.masses(1000.0).sum() == pytest.approx(fine.masses(1000.0).sum(), rel=0.01)
        assert body.positions[:, 1].min() >= 0.0
        assert body.muscle_membership.shape == (body.particle_count, body.muscle_count)
        assert (body.muscle_membership >= 0.0).all()
        assert (body.muscle_membership.sum(axis=1) <= 1.0 + 1e-12).all()
        assert (body.muscle_membership.sum(axis=0) > 0.0).all()
        assert np.linalg.norm(body.fibres, axis=1) == pytest.approx(1.0)
        assert body.head.any()
        assert body.tail.any()
        assert not (body.head & body.tail).any()


def _activity(controller: Controller, params: torch.Tensor) -> torch.Tensor:
    """Of three muscles over a standard episode `[200, worlds, 3]`; observations of a closed loop are random."""
    times = torch.arange(200, dtype=torch.float64) * FRAME_SECONDS
    if isinstance(controller, OpenLoop):
        return controller.actuation(params, times, 3)
    observations = torch.as_tensor(np.random.default_rng(5).normal(size=(200, SEEN)))
    frames = [
        torch.stack([controller.response(row, time, observed, 3) for row in params])
        for time, observed in zip(times.tolist(), observations, strict=True)
    ]
    return torch.stack(frames)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_controller_is_a_differentiable_map_into_the_range(name: str) -> None:
    """Activity has its shape, stays in [-1, 1], is none for zeros, and every parameter, if any, matters."""
    controller: Controller = registry.create(Kind.CONTROLLER, Ref(name))
    if isinstance(controller, OpenLoop):
        draws, count = (
            [controller.initial(np.random.default_rng(seed), 3) for seed in range(2)],
            controller.parameter_count(3),
        )
    else:
        draws = [controller.initial(np.random.default_rng(seed), 3, SEEN) for seed in range(2)]
        count = controller.parameter_count(3, SEEN)
    assert draws[0].shape == (count,)
    params = torch.tensor(np.array(draws), requires_grad=True)
    activity = _activity(controller, params)
    assert activity.shape == (200, 2, 3)
    assert activity.abs().max().item() <= 1.0
    assert not params.numel() or not _activity(controller, torch.zeros_like(params)).any()
    weights = torch.as_tensor(np.random.default_rng(0).normal(size=activity.shape))
    (gradient,) = torch.autograd.grad((activity * weights).sum(), params)
    assert (gradient != 0.0).all()


@pytest.mark.parametrize(("env", "task", "design"), CELLS)
def test_a_cell_is_finite_repeatable_and_differentiable(env: str, task: str, design: str) -> None:
    """Score, metrics with units, rewards and gradients are finite, and a second problem gives the same bits.

    The score is the mean reward, so that it does not grow with the episode, or of a final state the last. Its
    derivative along a random direction agrees with central differences.
    """
    spec = cell(environment=env, task=task, design=design, fidelity=DOUBLE)
    problem = Problem(spec)
    params = problem.initial(np.random.default_rng(1))
    evaluation, gradient = problem.loss_and_grad(params)
    assert evaluation.failure is None
    assert evaluation.reward.shape == (spec.frames,)
    if spec.task.name == "final-position":
        assert evaluation.score == evaluation.reward[-1]
    elif spec.task.name != "mix":
        assert evaluation.score == pytest.approx(evaluation.reward.mean(), rel=1e-12)
    assert {"score", "distance", "distance_travelled", "mean_speed"} <= set(evaluation.metrics)
    assert {"actuation_energy", "cost_of_transport"} <= set(evaluation.metrics)
    assert all(np.isfinite(metric.value) and metric.unit for metric in evaluation.metrics.values())
    assert np.isfinite(gradient).all()
    assert gradient.any()
    again, same_gradient = Problem(spec).loss_and_grad(params)
    np.testing.assert_array_equal(gradient, same_gradient)
    np.testing.assert_array_equal(evaluation.reward, again.reward)
    assert evaluation.metrics == again.metrics
    _check_gradient(problem, params, gradient)


REST_SPEEDS = {"ground": 1e-5, "wetland": 3e-6, "shallow-water": 1e-4, "ocean": 1e-4, POND: 1e-4}
"""Where a body does not rest to within 1e-6 m/s [m/s]: mud creeps, the water keeps a current of a tenth of a mm/s, and
on the ground a drawn body settles by up to 2e-6 m when it is let go, and rests then."""


def _idles(env: str, design: str) -> bool:
    """Every body on the ground, at the resolution of scores; the caterpillar everywhere, voxels but in the ocean."""
    return env == "ground" or design == "caterpillar" or (design == "voxel" and env != "ocean")


@pytest.mark.parametrize(
    ("env", "design"),
    [
        *(
            pytest.param(*names, marks=() if _idles(*names) else pytest.mark.slow)
            for names in itertools.product(ENVS, DESIGNS)
        ),
        pytest.param(POND, "voxel", id="pond-voxel"),
    ],
)
def test_a_body_without_a_mind_stays_where_it_is(env: str, design: str) -> None:
    """With all muscles at rest it moves by less than 1e-6 m/s, drawn bodies too: else its score is not its own.

    A body of a design space that was dropped into the state of its full workspace moved by 3e-3 m/s.
    """
    problem = Problem(cell(environment=env, design=design, frames=25, fidelity="draft" if env == "ground" else "smoke"))
    params = problem.initial(np.random.default_rng(3))
    params[: problem.robot.control_count] = 0.0
    evaluation = problem.evaluate(params)
    assert evaluation.failure is None
    assert abs(evaluation.metrics["distance"].value) < REST_SPEEDS.get(env, 1e-6) * 25 * FRAME_SECONDS


def _check_gradient(problem: Problem, params: Array, gradient: Array) -> None:
    """Along a random direction it is the best of the central differences of four widths."""
    direction = np.random.default_rng(2).normal(size=params.shape)
    direction /= np.linalg.norm(direction)
    along = -float(gradient @ direction)
    errors = []
    for width in (1e-5, 1e-4, 1e-6, 1e-3):
        up, down = (problem.relaxed(params + sign * width * direction).evaluation for sign in (1.0, -1.0))
        errors.append(abs((up.score - down.score) / (2 * width) - along))
        if errors[-1] <= 1e-4 * abs(along):
            return
    pytest.fail(f"The derivative is {along}; central differences are off by {errors}.")


@pytest.mark.parametrize("name", METHODS)
def test_a_method_solves_a_real_cell_within_its_budget(name: str) -> None:
    """Through the real simulator: a solution whose parameters give its score again."""
    component = registry.get(Kind.METHOD, name)
    tags, text = component.tags, f"{name}[population=4]" if "population" in component.parameters else name
    controller, text = ("policy-network", f"{name}[buffer=64]") if "policy" in tags else ("sine-basis", text)
    design = "voxel" if {"space", "sites"} & tags else "caterpillar"
    spec = cell(budget=Budget("iterations", 2), design=design, controller=controller, method=text)
    problem = Problem(spec)
    context = Context()
    solution = registry.create(Kind.METHOD, spec.method).run(problem, context)
    assert problem.meter.iterations == 2
    assert Problem(spec).evaluate(solution.params).score == solution.evaluation.score
    assert context.stored


@pytest.mark.parametrize("env", ["ground", "ocean"])
@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name != "sine-basis"])
def test_the_gradient_matches_differences_for_every_controller(env: str, name: str) -> None:
    """In double precision, along a random direction; the sine basis is in every cell above."""
    problem = Problem(cell(environment=env, controller=name, fidelity="smoke[precision=64]", frames=6))
    params = problem.initial(np.random.default_rng(1))
    _, gradient = problem.loss_and_grad(params)
    direction = np.random.default_rng(2).normal(size=len(params))
    # a step of 1e-5 reaches, in the ocean, where a frame takes another number of substeps
    ahead, behind = (problem.evaluate(params + sign * 1e-6 * direction).score for sign in (1.0, -1.0))
    assert -gradient @ direction == pytest.approx((ahead - behind) / 2e-6, rel=1e-5, abs=1e-12)
