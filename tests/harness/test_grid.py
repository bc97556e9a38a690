"""Selectors and grids: what is typed becomes runs, each once, or a refusal that helps."""

import pytest

from zoobench import registry
from zoobench.errors import UnknownNameError, UsageError
from zoobench.harness.grid import GridSpec, Skip, expand, parse_selector
from zoobench.registry import Kind, register
from zoobench.spec import Budget, Ref, RunSpec


def _ground(*, depth: float = 0.5) -> float:
    return depth


def _weighted(*, weight: float = 0.0) -> float:
    return weight


@pytest.fixture(autouse=True)
def _registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """A small world of its own."""
    monkeypatch.setattr(registry, "_components", {kind: {} for kind in Kind})
    monkeypatch.setattr(registry, "_discovered", set(Kind))
    for name in ("desert", "den", "ice"):
        register(Kind.ENV, name)(_ground)
    register(Kind.TASK, "turning")(lambda: None)
    register(Kind.TASK, "chess", tags=("no-gradient",))(lambda: None)
    register(Kind.DESIGN, "caterpillar")(lambda: None)
    register(Kind.DESIGN, "voxel", tags=("space", "sites"))(lambda: None)
    register(Kind.DESIGN, "implicit", tags=("space",))(lambda: None)
    register(Kind.CONTROLLER, "sine-basis")(lambda: None)
    register(Kind.METHOD, "diffphysics", tags=("gradient",))(lambda: None)
    register(Kind.METHOD, "random")(lambda: None)
    register(Kind.METHOD, "neat", tags=("sites",))(lambda: None)
    register(Kind.METHOD, "archive", tags=("space",))(lambda: None)
    register(Kind.FIDELITY, "smoke")(lambda: None)


def _grid(**changes: object) -> GridSpec:
    axes: dict[str, object] = {
        "envs": (Ref("desert"),),
        "tasks": (Ref("turning"),),
        "designs": (Ref("caterpillar"),),
        "controllers": (Ref("sine-basis"),),
        "methods": (Ref("diffphysics"), Ref("random")),
        "seeds": (0, 1),
        "budget": Budget("substeps", 10),
        "fidelity": Ref("smoke"),
        "frames": 6,
    }
    return GridSpec(**{**axes, **changes})  # type: ignore[arg-type]


def _names(text: str) -> list[str]:
    return [str(ref) for ref in parse_selector(text, Kind.ENV)]


def test_a_selector_is_a_list_of_names_patterns_and_parameters() -> None:
    """Order is kept, patterns are sorted, nothing comes twice, commas in brackets belong to the brackets."""
    assert _names("ice, desert,ice") == ["ice", "desert"]
    assert _names("*") == ["den", "desert", "ice"]
    assert _names("de*[depth=2],ice") == ["den[depth=2]", "desert[depth=2]", "ice"]
    assert _names("desert-v1[depth=2,other=3],ice") == ["desert-v1[depth=2,other=3]", "ice"]


@pytest.mark.parametrize("text", ["dessert", "desert,dessert", "dess*"])
def test_an_unknown_name_gets_did_you_mean(text: str) -> None:
    """A misspelt name or a pattern without a match suggests the nearest."""
    with pytest.raises(UnknownNameError, match="Did you mean 'desert'"):
        parse_selector(text, Kind.ENV)


@pytest.mark.parametrize("text", ["", "desert,", "Desert", "desert[depth", "desert[depth]", "desert-v9", "des ert"])
def test_a_malformed_selector_is_refused(text: str) -> None:
    """No shape but the documented ones is guessed at."""
    with pytest.raises(UsageError):
        parse_selector(text, Kind.ENV)


def test_a_grid_is_the_product_of_its_axes() -> None:
    """Every combination once, seeds fastest, every reference resolved."""
    runs = expand(_grid(envs=(Ref("desert"), Ref("ice"))))
    assert all(isinstance(run, RunSpec) for run in runs)
    assert [str(run) for run in runs][:3] == [
        "desert x turning x caterpillar x diffphysics seed 0",
        "desert x turning x caterpillar x diffphysics seed 1",
        "desert x turning x caterpillar x random seed 0",
    ]
    assert len(runs) == 8
    assert runs[0].env == Ref.parse("desert-v1[depth=0.5]")  # type: ignore[union-attr]


def test_the_same_run_asked_for_twice_is_one() -> None:
    """A default that is spelt out names the same run."""
    runs = expand(_grid(envs=(Ref("desert"), Ref.parse("desert[depth=0.5]")), seeds=(0, 0)))
    assert len(runs) == 2


def test_a_cell_that_cannot_be_run_is_skipped_with_its_reason() -> None:
    """A gradient method meets a task without gradient: a reason, no error, no hole."""
    runs = expand(_grid(tasks=(Ref("chess"),), seeds=(0,)))
    skips = [run for run in runs if isinstance(run, Skip)]
    assert [skip.reason for skip in skips] == [
        "The method 'diffphysics' needs a gradient, and the task 'chess' has none."
    ]
    assert len(runs) == 2


def test_a_method_that_trains_a_policy_skips_other_controllers() -> None:
    """The reason says which controllers are one."""
    register(Kind.METHOD, "teacher", tags=("policy",))(lambda: None)
    register(Kind.CONTROLLER, "network", tags=("policy",))(lambda: None)
    controllers = (Ref("sine-basis"), Ref("network"))
    skip, run = expand(_grid(controllers=controllers, methods=(Ref("teacher"),), seeds=(0,)))
    assert isinstance(skip, Skip)
    assert "'teacher' trains a policy" in skip.reason
    assert skip.reason.endswith("--controller network.")
    assert isinstance(run, RunSpec)


def test_a_method_that_makes_bodies_is_skipped_where_there_is_no_space_for_them() -> None:
    """What it needs and which designs have it; those cells run."""
    designs, methods = (Ref("caterpillar"), Ref("implicit"), Ref("voxel")), (Ref("neat"), Ref("archive"))
    runs = expand(_grid(designs=designs, methods=methods, seeds=(0,)))
    assert [run.reason for run in runs if isinstance(run, Skip)] == [
        "The method 'neat' needs a design space with a row of parameters for every site, and the design 'caterpillar' "
        "is none. Choose one that is: --design voxel.",
        "The method 'archive' needs a design space, and the design 'caterpillar' is none. "
        "Choose one that is: --design implicit,voxel.",
        "The method 'neat' needs a design space with a row of parameters for every site, and the design 'implicit' "
        "is none. Choose one that is: --design voxel.",
    ]
    done = [(run.design.name, run.method.name) for run in runs if isinstance(run, RunSpec)]
    assert done == [("implicit", "archive"), ("voxel", "neat"), ("voxel", "archive")]


def test_a_method_for_a_given_body_is_skipped_in_design_spaces() -> None:
    """The reason says which designs it can have; with those it runs."""
    register(Kind.METHOD, "teacher", tags=("given-body",))(lambda: None)
    designs = (Ref("caterpillar"), Ref("implicit"), Ref("voxel"))
    run, *skips = expand(_grid(designs=designs, methods=(Ref("teacher"),), seeds=(0,)))
    assert isinstance(run, RunSpec)
    assert [skip.reason for skip in skips if isinstance(skip, Skip)] == [
        f"The method 'teacher' needs a body that is given, and the design {name!r} is a design space. "
        "Choose one that is none: --design caterpillar."
        for name in ("implicit", "voxel")
    ]


@pytest.mark.parametrize("axis", ["envs", "methods", "seeds"])
def test_an_empty_axis_is_refused(axis: str) -> None:
    """A grid of nothing is a mistake, not zero runs."""
    with pytest.raises(UsageError, match=f"no {axis}"):
        expand(_grid(**{axis: ()}))


def test_a_negative_seed_is_refused() -> None:
    """The message names the seed."""
    with pytest.raises(UsageError, match="-1 is negative"):
        expand(_grid(seeds=(-1,)))


def test_a_glob_leaves_out_what_is_nothing_without_settings() -> None:
    """Unless settings are given; by its name it is always meant."""
    register(Kind.TASK, "turn-mix", tags=(registry.COMPOSED,))(_weighted)

    def names(text: str) -> list[str]:
        return [ref.name for ref in parse_selector(text, Kind.TASK)]

    assert names("turn*") == ["turning"]
    assert names("turn-*[weight=1]") == names("turn-mix") == ["turn-mix"]
