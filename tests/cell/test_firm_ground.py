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
    assert not firm_ground_fault(cell(environment="ocean[water=grid]", fidelity="smoke[particles_per_cell=1]"))


@pytest.mark.parametrize("setting", ["kernel=cubic", "transfer=apic", "medium_transfer=pic", "sleep=0"])
def test_settings_of_a_fidelity_without_effect_in_water_by_forces_are_refused(setting: str) -> None:
    """They would make another run with the same result; at their defaults, and elsewhere, they are fine."""
    fidelity = f"smoke[{setting}]"
    assert f"{setting} has no effect" in firm_ground_fault(cell(environment=SEA, fidelity=fidelity)).replace("0.0", "0")
    assert not firm_ground_fault(cell(environment="ocean[water=grid]", fidelity=fidelity))


@pytest.mark.parametrize("setting", ["kernel=quadratic,transfer=aflip", "courant=0.5", "shift=0.3", "precision=64"])
def test_settings_of_a_fidelity_with_effect_in_water_by_forces_are_not_refused(setting: str) -> None:
    """Defaults that are typed are not either."""
    assert not firm_ground_fault(cell(environment=SEA, fidelity=f"smoke[{setting}]"))
