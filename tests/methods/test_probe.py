"""The probe: the same controllers at every fidelity, with the requested records."""

import math

import numpy as np
import pytest

from tests.conformance.cells import cell
from tests.methods.toy import Context
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.harness.child import ChildContext
from zoobench.harness.grid import parse_selector
from zoobench.inputs import Start, find_with, named_runs, run_name
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec


def _curves(spec: RunSpec) -> dict[str, list[float]]:
    context = Context()
    curves: dict[str, list[float]] = {}
    registry.create(Kind.METHOD, spec.method).run(Problem(spec), context)
    for _, readings in context.curve:
        for name, value in readings.items():
            curves.setdefault(name, []).append(value)
    return curves


def test_draws_are_scored_and_the_first_ones_have_gradients() -> None:
    """As many as the budget allows; times and a whole gradient."""
    found = _curves(cell(Budget("iterations", 3), method="probe[gradients=2]"))
    assert len(found["score_current"]) == 3
    assert found["run"] == [0, 1, 2]
    assert set(found["particles"]) == {Problem(cell()).scene.particle_count}
    assert len(found["slope_1"]) == Problem(cell()).parameter_count
    assert "slope_2" not in found


def test_gaits_of_stored_runs_are_evaluated_the_early_ones_first() -> None:
    """Of two runs the last two stages each: a solution that is the last milestone counts once."""
    size = Problem(cell()).parameter_count
    gaits = [tuple(np.full(size, 0.1 * number)) for number in range(5)]
    starts = [Start(cell(seed=0), gaits[2], tuple(gaits[:3])), Start(cell(seed=1), gaits[4], (gaits[3],))]
    names = [run_name(start.spec.key()) for start in starts]
    find_with(dict(zip(names, starts, strict=True)).get)
    try:
        spec = cell(Budget("iterations", 9), method=f"probe[of={'+'.join(names)},last=2]")
        found = _curves(spec)
    finally:
        find_with(lambda name: None)
    assert [run_name(key) for key in named_runs(spec.method)] == names
    assert (found["run"], found["stage"]) == ([0, 1, 0, 1], [1, 0, 2, 1])
    own = [Problem(cell()).evaluate(np.array(gaits[number])).score for number in (1, 3, 2, 4)]
    assert found["score_current"] == own


def test_the_controllers_depend_neither_on_fidelity_nor_on_environment() -> None:
    """Another seed gives others."""

    def draw(spec: RunSpec) -> np.ndarray:
        return ChildContext(spec, None, None, None).rng.normal(size=4)  # type: ignore[arg-type]

    base = draw(cell(method="probe"))
    for other in (
        cell(method="probe[gradients=2]", fidelity="draft[precision=64]"),
        cell(method="probe", environment="ocean[water=grid,depth=0.2]"),
    ):
        np.testing.assert_array_equal(draw(other), base)
    assert (draw(cell(method="probe", seed=1)) != base).all()
    assert (draw(cell(method="random")) != draw(cell(method="random", environment="ice"))).all()


def test_patterns_pass_the_probe_over() -> None:
    """Only its exact name selects it."""
    assert "probe" not in {ref.name for ref in parse_selector("*", Kind.METHOD)}
    assert parse_selector("probe", Kind.METHOD) == [Ref("probe")]


@pytest.mark.parametrize("wrong", ["of=run-12", "last=0", "gradients=-1"])
def test_what_cannot_be_evaluated_is_refused(wrong: str) -> None:
    """Before anything runs."""
    with pytest.raises(UsageError):
        registry.create(Kind.METHOD, Ref.parse(f"probe[{wrong}]"))


def test_the_work_shares_out_the_gradients() -> None:
    """Two of eight gaits have one."""
    names = "+".join(run_name(cell(seed=seed).key()) for seed in range(2))
    work = registry.create(Kind.METHOD, Ref.parse(f"probe[of={names},last=4,gradients=2]")).work(100)
    assert (work.frames, work.gradient_frames) == (75.0, 25.0)
    assert math.isclose(registry.create(Kind.METHOD, Ref("probe")).work(100).frames, 100.0)
