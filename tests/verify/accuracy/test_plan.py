"""The runs of the study."""

from dataclasses import replace

import pytest

from zoobench.errors import UsageError
from zoobench.inputs import named_runs, run_name
from zoobench.spec import Ref
from zoobench_verify.accuracy.plan import (
    DESIGNS,
    KNOBS,
    LAND_DESIGNS,
    StudyPlan,
    draws,
    evaluations,
    trainings,
)

PLAN = StudyPlan(levels=("standard", "draft", "paper"), gradients="standard")


def test_every_cell_is_trained_at_every_home_with_every_seed() -> None:
    """Two levels, two tasks, four land animals and three swimmers, two seeds; cheap levels first."""
    specs = trainings([Ref("ground"), Ref("ocean")], [Ref("movement-speed"), Ref("turning")], PLAN)
    assert len({spec.key() for spec in specs}) == len(specs) == 56
    assert [spec.fidelity.name for spec in specs] == ["draft"] * 28 + ["standard"] * 28
    designs = {env: {spec.design.name for spec in specs if spec.env.name == env} for env in ("ground", "ocean")}
    assert designs == {"ground": set(LAND_DESIGNS), "ocean": set(DESIGNS["ocean"])}
    chosen = trainings([Ref("ocean")], [Ref("turning")], PLAN, [Ref("orca")])
    assert {spec.design.name for spec in chosen} == {"orca"}


def test_the_gaits_of_a_home_are_evaluated_at_every_level_in_one_run() -> None:
    """At three levels, and at the finest with the other transfer; gradients up to `standard`, of the first stages."""
    trained = trainings([Ref("ground")], [Ref("turning")], PLAN, [Ref("panda")])
    specs = evaluations(trained, PLAN)
    assert len(specs) == 2 * 4
    first = specs[0]
    assert [run_name(key) for key in named_runs(first.method)] == [run_name(spec.key()) for spec in trained[:2]]
    assert [spec.fidelity.name for spec in specs[::2]] == ["draft", "standard", "paper", "paper"]
    assert specs[6].fidelity.kwargs["transfer"] != specs[4].fidelity.kwargs["transfer"]
    assert [spec.method.kwargs["gradients"] for spec in specs[::2]] == [2, 2, 0, 0]
    assert first.budget.amount == 8


def test_solutions_of_the_first_seed_are_evaluated_beyond_the_finest_level() -> None:
    """One gait for each level where gaits were found, the last of its training."""
    plan = replace(PLAN, beyond="fine")
    trained = trainings([Ref("ground")], [Ref("turning")], plan, [Ref("panda")])
    *others, draft, standard = evaluations(trained, plan)
    assert others == evaluations(trained, PLAN)
    assert [spec.fidelity.name for spec in (draft, standard)] == ["fine"] * 2
    assert draft.method.kwargs["of"] == run_name(trained[0].key())
    assert standard.method.kwargs["of"] == run_name(trained[2].key())
    assert (draft.budget.amount, draft.method.kwargs["last"], draft.method.kwargs["gradients"]) == (1, 1, 0)


def test_knobs_are_turned_around_one_level() -> None:
    """Each alone; one that is the default there already is not measured twice."""
    turned = replace(PLAN, around="draft").fidelities()
    assert len(turned) == len(PLAN.fidelities()) + len(KNOBS) - 1
    assert len(set(turned)) == len(turned)


def test_random_controllers_are_the_same_everywhere() -> None:
    """None by default; with draws, a run for every cell and fidelity, whose seed has nothing of the place."""
    place = [Ref("ground")], [Ref("turning")]
    assert draws(*place, PLAN) == []
    specs = draws(*place, replace(PLAN, draws=3))
    assert len(specs) == 4 * len(LAND_DESIGNS)
    assert {spec.controller.kwargs["scale"] for spec in specs} == {1.0}
    assert not any(named_runs(spec.method) for spec in specs)


@pytest.mark.parametrize(
    "wrong",
    [
        {"levels": ("smoke",)},
        {"levels": ()},
        {"found": ("coarse",)},
        {"around": "coarse"},
        {"seeds": 0},
        {"beyond": "fine"},
    ],
)
def test_a_plan_that_makes_no_sense_is_refused(wrong: dict[str, object]) -> None:
    """With the values that are possible."""
    with pytest.raises(UsageError):
        StudyPlan(**wrong)  # type: ignore[arg-type]


def test_nothing_to_study_is_refused() -> None:
    """No environment."""
    with pytest.raises(UsageError, match="environment and a task"):
        trainings([], [Ref("turning")], PLAN)
