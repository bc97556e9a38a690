"""The runs of the study."""

import pytest

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.verify.accuracy.plan import BULK_FACTORS, KNOBS, NUDGE, QUICK, SHIFTS, StudyPlan, specs

TASKS = [Ref("movement-speed"), Ref("turning")]


def test_every_level_knob_and_shift_is_a_run_or_two() -> None:
    """One that scores many controllers by all tasks, one that records trajectories of a few."""
    plan = StudyPlan(levels=("draft", "paper"), around="draft", draws=(12, 6))
    found = specs([Ref("ground")], TASKS, plan)
    assert len(found) == 2 * (2 + len(KNOBS) + len(SHIFTS) + 1)
    assert [spec.budget.amount for spec in found[:4]] == [12, 2, 6, 2]
    assert all(spec.method.kwargs["also"] == "turning" for spec in found[::2])
    assert {spec.frames for spec in found} == {plan.frames, plan.close_frames}
    assert NUDGE in {spec.fidelity.kwargs["shift"] for spec in found}


@pytest.mark.parametrize("env", ["ocean", "shallow-water", "ocean[bulk_modulus=2e5]"])
def test_water_is_also_made_stiffer_and_softer(env: str) -> None:
    """The Mach number is a knob where there is water, around that water's own stiffness, and nowhere else."""
    plan = StudyPlan(levels=("draft",), around="draft", draws=(4,), close=0)
    moduli = {spec.env.kwargs["bulk_modulus"] for spec in specs([Ref.parse(env)], TASKS, plan)}
    usual = registry.resolve(Kind.ENV, Ref.parse(env)).kwargs["bulk_modulus"]
    assert moduli == {usual, *(factor * usual for factor in BULK_FACTORS)}
    assert len({str(spec.env) for spec in specs([Ref("desert")], TASKS, plan)}) == 1


def test_no_run_is_asked_for_twice() -> None:
    """A level in the ladder that is also turned around stands there once."""
    keys = [spec.key() for spec in specs([Ref("ground")], TASKS, QUICK)]
    assert len(keys) == len(set(keys)) == 4


@pytest.mark.parametrize(
    "wrong",
    [{"levels": ("smoke",)}, {"levels": ()}, {"draws": (1, 2)}, {"around": "coarse"}, {"draws": (0,)}],
)
def test_a_plan_that_makes_no_sense_is_refused(wrong: dict[str, object]) -> None:
    """With the values that are possible."""
    with pytest.raises(UsageError):
        StudyPlan(**{"levels": ("draft",), "around": "", "draws": (3,), **wrong})  # type: ignore[arg-type]
