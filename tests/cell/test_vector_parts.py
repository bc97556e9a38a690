"""The parts of an observation, by name."""

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.observation import layout_of
from zoobench.cell.problem import Problem
from zoobench.cell.session import observation_model
from zoobench.cell.vector_parts import observation_parts
from zoobench.registry import Kind
from zoobench.spec import Ref

TASKS = [
    "mix[movement-speed=1,final-position=2]" if registry.get(Kind.TASK, name).needs_settings else name
    for name in registry.names(Kind.TASK)
]


@pytest.mark.parametrize("text", TASKS)
def test_parts_cover_the_observation_of_every_task(text: str) -> None:
    """One after the other, as long as their shapes say, each with a unit and a meaning; the phase comes last."""
    task = registry.create(Kind.TASK, registry.resolve(Kind.TASK, Ref.parse(text)))
    parts = observation_parts(5, task)
    assert [part.start for part in parts] == [0, *(part.stop for part in parts[:-1])]
    assert all(part.stop - part.start == np.prod(part.shape) for part in parts)
    layout = layout_of(5, task)
    assert parts[-2].stop == sum(count for _, count in layout)
    assert [part.name for part in parts[5:-1]] == [name for name, _ in layout[2:]]
    assert (parts[-1].name, parts[-1].shape) == ("phase", (2,))
    assert all(part.unit and part.meaning for part in parts)
    assert len({part.name for part in parts}) == len(parts)


def test_a_slice_is_what_its_name_says() -> None:
    """Of a robot that has moved, turned and been stretched by known amounts since its start."""
    problem = Problem(cell(task="final-position[x=0.1]", frames=4))
    model, body = observation_model(problem), problem.body
    start = torch.as_tensor(body.positions)
    quarter = torch.tensor([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]], dtype=torch.float64)  # to the left
    way, speed = torch.tensor([0.02, 0.0, -0.01]), torch.tensor([0.3, 0.0, 0.0])
    now = start @ quarter.T + way
    seen = model.observe(1, now, speed.double().expand_as(now), start, torch.ones(len(start), dtype=torch.float64))
    parts = {
        part.name: seen[part.slice].reshape(part.shape).numpy()
        for part in observation_parts(body.muscle_count, problem.task)[:-1]
    }
    moved = (now - start).mean(dim=0).numpy() / model.length
    np.testing.assert_allclose(np.abs(parts["heading"]), [0.0, 1.0], atol=1e-3)
    np.testing.assert_allclose(parts["displacement"], moved, atol=1e-2)
    np.testing.assert_allclose(np.linalg.norm(parts["velocity"]), 0.3 / (20.0 * model.length), rtol=1e-3)
    np.testing.assert_allclose(parts["muscle_velocities"], 0.0, atol=1e-9)
    np.testing.assert_allclose(parts["muscle_displacements"], 0.0, atol=1e-2)
    assert parts["time_left"] == [0.75]


def test_a_task_that_names_no_units_has_parts_without() -> None:
    """Of a package of others; the observation is the same."""

    class Quiet:
        unit = "m"

        def observed(self, situation: object) -> dict[str, torch.Tensor]:
            return {"scent": torch.zeros(2)}

    (scent,) = (part for part in observation_parts(5, Quiet()) if part.name == "scent")  # type: ignore[arg-type]
    assert (scent.shape, scent.unit, scent.meaning) == ((2,), "", "")
