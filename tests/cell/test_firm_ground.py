"""What needs firm ground is refused elsewhere, before anything runs."""

from typing import Any

import pytest

from tests.conformance.cells import SEA, cell
from zoobench.cell.firm_ground import firm_ground_fault, held_fault


@pytest.mark.parametrize(
    ("names", "why"),
    [
        ({"design": "arm", "fidelity": "smoke[robot=lagrangian]"}, "cannot be held"),
        ({"design": "gripper", "environment": "ocean"}, "water of 'ocean'"),
        ({"design": "gripper[base_speed=0.1]", "environment": "desert"}, "'desert' has a bed"),
    ],
)
def test_a_base_is_refused_where_it_can_not_be_held_or_not_move(names: dict[str, Any], why: str) -> None:
    """With the remedy."""
    fault = held_fault(cell(**names))
    assert why in fault
    assert "Choose" in fault


@pytest.mark.parametrize(
    "names",
    [
        {"design": "gripper", "environment": "desert"},
        {"design": "arm[base_speed=0.1]", "environment": "ice"},
        {"environment": "ocean"},
    ],
)
def test_what_can_be_held_and_what_has_no_base_is_not_refused(names: dict[str, Any]) -> None:
    """A base that does not move may hang above a bed."""
    assert not held_fault(cell(**names))


def test_a_fidelity_that_water_by_forces_is_not_simulated_with_is_refused() -> None:
    """Before the run, and not by it; in other water it is fine."""
    assert "particles_per_cell=8 or 27" in firm_ground_fault(
        cell(environment=SEA, fidelity="smoke[particles_per_cell=1]")
    )
    assert not firm_ground_fault(cell(environment="ocean", fidelity="smoke[particles_per_cell=1]"))
