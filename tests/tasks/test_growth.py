"""Growth of height, span and area, and given proportions, against closed forms."""

import math

import pytest
import torch

from tests.tasks.motions import lattice, mapped, motion, pitch, yaw
from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.base import Motion
from zoobench.tasks.shape import ShapeTask

BOX = lattice(spacing=0.0025)
STRETCH = torch.diag(torch.tensor([1.2, 0.8, 1.1], dtype=torch.float64))
ONE = torch.eye(3, dtype=torch.float64)


def _score(task: str, found: Motion) -> float:
    return float(registry.create(Kind.TASK, Ref.parse(task)).score(found))


@pytest.mark.parametrize(
    ("task", "growth"),
    [
        ("height", -0.2 * 0.05),
        ("span", 0.2 * 0.1),
        ("area", 0.32 * 0.1 * 0.04),
        ("area[shrink=true]", -0.32 * 0.1 * 0.04),
    ],
)
def test_a_stretched_box_scores_by_its_measures(task: str, growth: float) -> None:
    """The mean over the frames: half of the time scores half; greatest and final growth are reported."""
    found = mapped(BOX, [STRETCH, STRETCH, ONE, ONE])
    assert _score(task, found) == pytest.approx(growth / 2, rel=0.02)
    metrics = registry.create(Kind.TASK, Ref.parse(task)).metrics(found)
    assert float(metrics["greatest_growth"][0]) == pytest.approx(max(growth, 0.0), rel=0.02, abs=1e-15)
    assert float(metrics["final_growth"][0]) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("task", "turned", "growth"),
    [("height", pitch(math.pi / 2), 0.05), ("span", pitch(math.pi / 2), -0.05), ("area", yaw(0.7), 0.0)],
)
def test_a_body_that_rises_on_its_tail_is_higher(task: str, turned: torch.Tensor, growth: float) -> None:
    """And shorter; one that turns on the spot covers the ground that it did."""
    assert _score(task, mapped(BOX, [turned])) == pytest.approx(growth, abs=5e-4)


@pytest.mark.parametrize("task", ["height", "span", "area", "shape"])
def test_jumping_and_walking_change_no_measure(task: str) -> None:
    """Nor does it matter where a body starts."""
    away = BOX + torch.tensor([3.0, 0.4, -2.0], dtype=torch.float64)
    assert _score(task, motion(BOX, torch.stack([BOX, away]))) == pytest.approx(0.0, abs=1e-15)


def test_a_swaying_body_is_not_higher() -> None:
    """What it gains while it is sheared one way, it does not gain the other."""
    sways = []
    for n in range(40):
        sway = ONE.clone()
        sway[0, 1] = 0.4 * math.sin(n)
        sways.append(sway)
    assert abs(_score("height", mapped(BOX, sways))) < 1e-9


def test_the_shape_scores_the_fall_of_the_distance() -> None:
    """A box that has taken on the proportions scores the error at the start, one that goes the other way below 0."""
    wanted = math.hypot(0.2 * 0.1, 0.2 * 0.05, 0.1 * 0.04)
    task = ShapeTask(length=1.2, height=0.8, width=1.1)
    assert float(task.score(mapped(BOX, [STRETCH]))) == pytest.approx(wanted, rel=0.01)
    assert float(task.score(mapped(BOX, [STRETCH.inverse()]))) < 0.0
    metrics = task.metrics(mapped(BOX, [STRETCH]))
    assert float(metrics["first_error"][0]) == pytest.approx(wanted, rel=0.01)
    assert float(metrics["final_error"][0]) == pytest.approx(0.0, abs=1e-12)
