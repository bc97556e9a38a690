"""Settings that a fidelity refuses, and more particles than it asks for."""

from dataclasses import replace

import pytest

from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"grid_spacing": 0.0}, "grid spacing 0 m"),
        ({"grid_spacing": -0.1}, "grid spacing"),
        ({"grid_spacing": 1.0}, "Try 1/64"),
        ({"grid_spacing": float("nan")}, "grid spacing"),
        ({"courant": 0.0}, "Courant fraction 0 "),
        ({"courant": 0.91}, "0.7 is a good choice"),
        ({"courant": float("nan")}, "Courant fraction"),
        ({"particles_per_cell": 2}, r"Choose one of \(1, 4, 8, 27\)"),
        ({"precision": 16}, "Choose 32 or 64"),
        ({"transfer": "flip"}, "The transfer 'flip' is not offered. Choose one of apic, pic, aflip"),
        ({"robot": "lagrangian", "particles_per_cell": 1}, "Give 8 or 27, or robot=mpm"),
        ({"robot": "lagrangian", "particles_per_cell": 4}, "Give 8 or 27, or robot=mpm"),
        ({"kernel": "linear"}, "The kernel 'linear' is not offered. Choose one of quadratic, cubic"),
    ],
)
def test_unusable_setting_is_refused(changes: dict[str, float | str], complaint: str) -> None:
    """With the value given and what to do instead."""
    settings: dict[str, float | str] = {"grid_spacing": 1 / 32} | changes
    with pytest.raises(UsageError, match=complaint):
        Fidelity(**settings)  # type: ignore[arg-type]


def test_bounds_are_part_of_the_range() -> None:
    """The largest Courant fraction is usable."""
    assert Fidelity(1 / 32, courant=0.9).courant == 0.9


def test_a_design_can_have_more_particles_but_not_fewer() -> None:
    """The larger of the two numbers counts, and nothing else changes."""
    coarse = Fidelity(1 / 64)
    assert coarse.with_particles(27) == replace(coarse, particles_per_cell=27)
    assert coarse.with_particles(1) == coarse
