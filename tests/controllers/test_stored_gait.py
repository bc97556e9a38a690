"""Stored gaits: what a run has found drives another body, and has no parameters there."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.cell.robot import Robot
from zoobench.controllers.base import ClosedLoop, OpenLoop
from zoobench.errors import UsageError
from zoobench.inputs import Start, run_name
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec

TIMES = torch.arange(12, dtype=torch.float64) * FRAME_SECONDS
NONE = torch.zeros(1, 0, dtype=torch.float64)
POLICY = "policy-network[hidden=4]"


def is_space(name: str) -> bool:
    """Whether a design is a design space."""
    return "space" in registry.get(Kind.DESIGN, name).tags


def solved(spec: RunSpec) -> Start:
    """A run with a draw of its prior for a solution."""
    robot = Robot.of_run(spec)
    return Start(spec, tuple(robot.initial(np.random.default_rng(6)).tolist()))


def stored(keep: dict[str, Start], spec: RunSpec) -> str:
    """The run as a stored gait or body."""
    name = run_name(spec.key())
    keep[name] = solved(spec)
    return f"stored[run={name}]"


@pytest.mark.parametrize("controller", ["sine-basis", "trajectory[frames=12]", "fixed-sine"])
@pytest.mark.parametrize("design", ["caterpillar", "voxel"])
def test_an_open_gait_is_that_of_the_run(keep: dict[str, Start], controller: str, design: str) -> None:
    """The same activity from no parameters, whether the run had a body of its own to find or not."""
    spec = cell(controller=controller, design=design)
    gait = registry.create(Kind.CONTROLLER, Ref.parse(stored(keep, spec)))
    assert isinstance(gait, OpenLoop)
    robot = Robot.of_run(spec)
    (start,) = keep.values()
    params = torch.tensor([start.params[: robot.control_count]], dtype=torch.float64)
    muscles = robot.body.muscle_count
    assert isinstance(robot.controller, OpenLoop)
    wanted = robot.controller.actuation(params, TIMES, muscles)
    assert gait.parameter_count(muscles) == len(gait.initial(np.random.default_rng(0), muscles)) == 0
    assert torch.equal(gait.actuation(NONE, TIMES, muscles), wanted)
    both = gait.actuation(NONE.expand(2, 0), TIMES, muscles)
    assert torch.equal(both[:, 0], both[:, 1])


@pytest.mark.parametrize("sees", ["all", "body"])
def test_a_policy_is_that_of_the_run(keep: dict[str, Start], sees: str) -> None:
    """It responds as it did, and is given what it was given."""
    spec = cell(controller=f"policy-network[hidden=4,sees={sees}]", task="velocity-tracking")
    gait_spec = replace(spec, controller=registry.resolve(Kind.CONTROLLER, Ref.parse(stored(keep, spec))))
    home, robot = Robot.of_run(spec), Robot.of_run(gait_spec)
    assert isinstance(robot.controller, ClosedLoop)
    assert isinstance(home.controller, ClosedLoop)
    assert robot.layout == home.layout
    seen = torch.as_tensor(np.random.default_rng(1).normal(size=sum(count for _, count in home.layout)))
    (start,) = keep.values()
    params, muscles = torch.tensor(start.params, dtype=torch.float64), home.body.muscle_count
    wanted = home.controller.response(params, 0.1, seen, muscles)
    assert torch.equal(robot.controller.response(NONE[0], 0.1, seen, muscles), wanted)


def test_a_stored_gait_on_its_own_body_has_the_score_of_the_run(keep: dict[str, Start]) -> None:
    """Bit for bit; and what is optimised is the body alone."""
    spec = cell(design="voxel[edge=0.025,optimise=geometry]", frames=4)
    found = stored(keep, spec)
    (start,) = keep.values()
    problem = Problem(replace(spec, controller=registry.resolve(Kind.CONTROLLER, Ref.parse(found))))
    control = Robot.of_run(spec).control_count
    params = np.array(start.params)
    assert problem.parameter_count == len(params) - control
    again, gradient = problem.loss_and_grad(params[control:])
    assert again.score == Problem(spec).evaluate(params).score
    assert np.isfinite(gradient).all()
    assert gradient.any()


WAVES = {"travelling-wave"}
"""Controllers that ask where the muscles are."""


@pytest.mark.parametrize("design", [name for name in registry.names(Kind.DESIGN) if is_space(name)])
@pytest.mark.parametrize("controller", [name for name in registry.names(Kind.CONTROLLER) if name != "stored"])
def test_every_stored_gait_drives_every_space_of_its_muscles(
    keep: dict[str, Start], controller: str, design: str
) -> None:
    """A gait of eight muscles in a space of eight."""
    home = cell(controller=controller, design="clownfish")
    away = cell(controller=stored(keep, home), design=design)
    robot, found = Robot.of_run(away), Robot.of_run(home)
    assert robot.control_count == 0
    assert robot.layout == found.layout
    if isinstance(robot.controller, OpenLoop):
        (start,) = keep.values()
        params = torch.tensor([start.params], dtype=torch.float64)
        activity = robot.controller.actuation(NONE, TIMES, 8)
        assert activity.abs().max() > 0.01
        assert isinstance(found.controller, OpenLoop)
        same = torch.equal(activity, found.controller.actuation(params, TIMES, 8))
        assert same or controller in WAVES, "a wave runs where the muscles of its body are"


def test_a_stored_gait_of_a_stored_gait_is_the_first(keep: dict[str, Start]) -> None:
    """Bodies and gaits can be optimised in turn."""
    first = stored(keep, cell())
    second = stored(keep, cell(controller=first, design="voxel[base=caterpillar]"))
    gaits = [registry.create(Kind.CONTROLLER, Ref.parse(text)) for text in (first, second)]
    muscles = Robot.of_run(cell()).body.muscle_count
    one, other = (gait.actuation(NONE, TIMES, muscles) for gait in gaits)
    assert torch.equal(one, other)


@pytest.mark.parametrize(
    ("home", "away", "reason"),
    [
        ({}, {"design": "block"}, r"drives the [0-9]+ muscles of caterpillar.*this body has 8"),
        (
            {"controller": POLICY, "task": "movement-speed"},
            {"task": "velocity-tracking"},
            r"it observes .*target direction \(2\).*is given .*target velocity \(2\).*task movement-speed",
        ),
    ],
)
def test_a_gait_that_does_not_fit_is_refused(
    keep: dict[str, Start], home: dict[str, str], away: dict[str, str], reason: str
) -> None:
    """Other muscles, or other things to see."""
    found = stored(keep, cell(**home))
    with pytest.raises(UsageError, match=reason):
        Robot.of_run(cell(controller=found, **away))


def test_a_run_that_is_not_there_is_refused(keep: dict[str, Start]) -> None:
    """With what to do."""
    for kind in (Kind.CONTROLLER, Kind.DESIGN):
        with pytest.raises(UsageError, match=r"run-0123456789abcdef is not in this database and done. Do that run"):
            registry.create(kind, Ref.parse("stored[run=run-0123456789abcdef]"))
        with pytest.raises(UsageError, match=r"write stored\[run=...\]"):
            registry.create(kind, Ref.parse("stored"))
