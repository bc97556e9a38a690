"""Presets name what exists and fill in what the user leaves open."""

import pytest

from zoobench.errors import UnknownNameError
from zoobench.harness import presets
from zoobench.harness.grid import expand
from zoobench.spec import Budget, Ref, RunSpec


@pytest.mark.parametrize("name", presets.names())
def test_every_preset_can_be_run(name: str) -> None:
    """Its fidelity, methods, design and controller are registered and take its settings."""
    runs = expand(presets.get(name).grid([Ref("desert")], [Ref("turning")]))
    assert runs
    assert all(isinstance(run, RunSpec) for run in runs)


def test_smoke_runs_carry_the_fidelity_smoke() -> None:
    """Tables know smoke rows by it."""
    assert presets.get("smoke").fidelity.name == "smoke"
    assert all(presets.get(name).fidelity.name != "smoke" for name in presets.names() if name != "smoke")


def test_the_default_is_a_preset_with_at_least_two_seeds() -> None:
    """A table of it has intervals."""
    assert len(presets.get(presets.DEFAULT).seeds) >= 2


def test_a_bare_method_gets_the_presets_settings_and_an_explicit_one_keeps_its_own() -> None:
    """What the user writes wins; the rest is the preset's."""
    paper = presets.get("paper")
    grid = paper.grid([Ref("ice")], [Ref("turning")], methods=[Ref.parse("diffphysics[lr=0.5]"), Ref("other")])
    assert grid.methods == (Ref.parse("diffphysics[lr=0.5,iterations=30,restarts=8]"), Ref("other"))


def test_what_is_given_replaces_the_presets_choice() -> None:
    """Every setting can be overridden on its own."""
    budget = Budget("seconds", 5)
    grid = presets.get("quick").grid([Ref("ice")], [Ref("turning")], seeds=[7], budget=budget, frames=3)
    assert (grid.seeds, grid.budget, grid.frames) == ((7,), budget, 3)
    assert grid.fidelity == presets.get("quick").fidelity


def test_an_unknown_preset_gets_did_you_mean() -> None:
    """A misspelt preset suggests the nearest."""
    with pytest.raises(UnknownNameError, match="Did you mean 'quick'"):
        presets.get("quik")
