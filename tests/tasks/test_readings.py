"""Common readings against closed forms."""

import dataclasses

import pytest
import torch

from tests.tasks.motions import block, disc, motion, rigid
from zoobench.tasks.readings import common_readings


def _values(readings: dict[str, tuple[torch.Tensor, str]]) -> dict[str, float]:
    return {name: value.item() for name, (value, _) in readings.items()}


def test_the_way_over_the_ground_is_horizontal() -> None:
    """Falling is no distance; on a straight line distance and distance travelled are equal."""
    readings = common_readings(rigid(disc(), spin=0.0, velocity=(0.3, -1.0, 0.4)))
    values = _values(readings)
    assert values["distance"] == pytest.approx(0.5 * 20 * 0.008)
    assert values["distance_travelled"] == pytest.approx(0.5 * 20 * 0.008)
    assert values["mean_speed"] == pytest.approx(0.5)
    units = {name: unit for name, (_, unit) in readings.items()}
    assert units == {
        "distance": "m",
        "distance_travelled": "m",
        "mean_speed": "m/s",
        "actuation_energy": "J",
        "cost_of_transport": "1",
    }


def test_there_and_back_is_travelled_but_no_distance() -> None:
    """Two frames of 3 cm each, the second backwards."""
    rest = block()
    path = torch.stack([rest, rest + torch.tensor([0.03, 0.0, 0.0]), rest])
    values = _values(common_readings(motion(rest, path)))
    assert values["distance"] == 0.0
    assert values["distance_travelled"] == pytest.approx(0.06)


def test_energy_is_what_the_muscles_gave_and_not_what_they_took() -> None:
    """Work of 3 mJ and 2 mJ counts, -5 mJ does not; the cost is per weight and distance."""
    rest = block(count=1)
    path = torch.stack([rest, rest + torch.tensor([0.03, 0.0, 0.04]), rest])
    work = torch.tensor([[[3e-3, -5e-3]], [[0.0, 2e-3]]], dtype=torch.float64)
    values = _values(common_readings(motion(rest, path, work=work)))
    assert values["actuation_energy"] == pytest.approx(5e-3)
    assert values["cost_of_transport"] == pytest.approx(5e-3 / (4.0 * 9.81 * 0.1))


def test_a_robot_that_does_nothing_costs_nothing() -> None:
    """Also where it does not move and zero is divided by zero."""
    rest = block()
    still = motion(rest, torch.stack([rest, rest]))
    assert _values(common_readings(still))["cost_of_transport"] == 0.0


def test_massless_particles_do_not_weigh() -> None:
    """They have no influence on distance or cost."""
    rest = block(count=1)
    path = torch.stack([rest, rest + torch.tensor([0.03, 0.0, 0.0])])
    whole = motion(rest, path, work=torch.full((1, 1, 1), 1e-3, dtype=torch.float64))
    positions, masses = whole.positions.clone(), torch.tensor([[0.0, 1.0, 1.0, 2.0]], dtype=torch.float64)
    positions[1, 0, 0] += 7.0
    part = dataclasses.replace(whole, positions=positions, masses=masses)
    assert _values(common_readings(part)) == pytest.approx(_values(common_readings(whole)))
