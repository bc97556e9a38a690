"""Presets name what exists and fill in what the user leaves open."""

from dataclasses import replace

import pytest

from zoobench import registry
from zoobench.errors import UnknownNameError
from zoobench.harness import presets
from zoobench.harness.grid import expand
from zoobench.registry import Kind, resolve
from zoobench.spec import Budget, Ref, RunSpec


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name == "animals" else ()) for name in presets.names()]
)
def test_every_preset_can_be_run(name: str) -> None:
    """Its fidelity, methods, design and controller are registered and take its settings."""
    runs = expand(presets.get(name).grid([Ref("desert")], [Ref("turning")]))
    assert runs
    assert all(isinstance(run, RunSpec) for run in runs)


@pytest.mark.parametrize(
    ("name", "method", "settings"),
    [
        ("animals", "diffphysics", {"lr": 0.1, "iterations": 30, "restarts": 8}),
        ("control", "diffphysics", {"lr": 0.01, "iterations": 100, "restarts": 8}),
        ("design", "diffphysics", {"lr": 0.01, "iterations": 100, "restarts": 8}),
        ("codesign", "diffphysics", {"lr": 0.01, "iterations": 250, "restarts": 8}),
        ("codesign", "evolution", {"sigma": 0.1, "population": 10, "generations": 100}),
        ("ppo", "ppo", {"timesteps": 100_000, "buffer": 2048, "batch": 32, "gae": 0.95, "discount": 0.98, "epochs": 20,
                        "entropy": 0.001, "lr": 1e-4, "clip": 0.2}),
    ],
)  # fmt: skip
def test_presets_have_the_settings_of_the_specification(name: str, method: str, settings: dict[str, float]) -> None:
    """F.1 to F.3, at the fidelity of the published benchmark, and with a budget that ends no method before its own."""
    preset = presets.get(name)
    stated = resolve(Kind.METHOD, preset.with_settings(Ref(method))).kwargs
    assert settings.items() <= stated.items()
    assert preset.fidelity.name == presets.get("paper").fidelity.name
    needed = -(-100_000 // 2048) if method == "ppo" else settings.get("iterations", settings.get("generations"))
    assert preset.budget.kind == "iterations"
    assert preset.budget.amount >= needed


def test_softzoo_restores_the_constants_of_the_published_code() -> None:
    """Gravity, beds, the constants of snow and swimmer; what the user states stays; all else is that of `paper`."""
    names = registry.names(Kind.ENV)
    grid = presets.get("softzoo").grid(list(map(Ref, names)), [Ref("turning")])
    assert [env.name for env in grid.envs] == names
    made = {env.name: registry.create(Kind.ENV, env) for env in grid.envs}
    assert {env.gravity for env in made.values()} == {(0.0, -3.8, 0.0)}
    assert made["snow"].bed.material.hardening == 1.0
    assert made["snow"].bed.material.critical_stretch == 4.5e-3
    assert (made["ocean"].robot.youngs_modulus, made["ocean"].robot.muscle_strength) == (1e5, 1.5e4)
    beds = [env for env in made.values() if env.bed is not None]
    assert len(beds) == 6
    assert {(env.arena[0], env.arena[2], env.bed.material.density) for env in beds} == {(0.5, 0.5, 1000.0)}
    own = presets.get("softzoo").grid([Ref.parse("snow[gravity=1.6]")], [Ref("turning")])
    assert own.envs[0].kwargs == {**grid.envs[names.index("snow")].kwargs, "gravity": 1.6}
    paper = presets.get("paper").grid([Ref("ice")], [Ref("turning")])
    assert replace(presets.get("softzoo").grid([Ref("ice")], [Ref("turning")]), envs=paper.envs) == paper


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
