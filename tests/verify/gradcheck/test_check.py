"""The check of gradients must be able to fail, and must tell chaos from a wrong gradient."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.conformance.cells import POND
from zoobench.cell.motion import BODY_ARRAYS
from zoobench.errors import UsageError
from zoobench.sim.adjoint import Adjoint
from zoobench.sim.model.rollout import FloatArray, Gradient
from zoobench.sim.model.segmentation import Part
from zoobench.sim.model.state import IntArray
from zoobench.spec import Ref
from zoobench_verify.gradcheck import check as study
from zoobench_verify.gradcheck.check import GradRow, e_fold, gradcheck, summarise
from zoobench_verify.gradcheck.gradient_case import NUDGE, GradientCase


def _case(env: str = "ground") -> GradientCase:
    return GradientCase(Ref(env), Ref("movement-speed"))


def test_a_wrong_gradient_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """An adjoint off by a tenth of a percent in one group is wrong there, and only there; no kink is reported."""
    run = Adjoint.run

    def spoilt(self: Adjoint, *adjoints: FloatArray) -> Gradient:
        gradient = run(self, *adjoints)
        return replace(gradient, stiffness=1.001 * gradient.stiffness)

    monkeypatch.setattr(Adjoint, "run", spoilt)
    rows = list(gradcheck(_case(), (20,), directions=2))
    assert {row.group: row.is_right for row in rows} == {
        group: group != "stiffness" for group in ("actuation", *BODY_ARRAYS)
    }
    assert not any(row.kinks for row in rows)


def test_episodes_beside_an_object_part_by_the_robot_alone() -> None:
    """What sets them apart, and what is told of it, is the robot's."""
    case = GradientCase(Ref.parse("ground[object=box]"), Ref("push"))
    _, apart = case.separation(1, np.random.default_rng(0))
    assert apart[0] == pytest.approx(NUDGE / 32)  # of a cell of `smoke`
    assert len(apart) == 2


@pytest.mark.slow
def test_a_body_of_several_tissues_can_be_stiffened() -> None:
    """Differences go a little beyond the stiffest and the lightest tissue: fins twice as stiff as muscle, and fat."""
    case = GradientCase(Ref("ground"), Ref("movement-speed"), Ref("panda"))
    base = case.base(1)
    stiffer = {**base, "stiffness": 1.01 * base["stiffness"], "density_ratio": 0.99 * base["density_ratio"]}
    assert np.isfinite(case.objective(case.run(stiffer)))


@pytest.mark.slow
@pytest.mark.parametrize("env", [pytest.param("ground", id="land"), pytest.param(POND, id="water")])
def test_the_gradient_reaches_the_parameters_of_a_design_space(env: str) -> None:
    """Through shape, mass, displaced water and the weights of the score, as central differences have it."""
    body = GradientCase(Ref.parse(env), Ref("turning"), Ref("voxel"))
    rows = {row.group: row for row in gradcheck(body, (20,), directions=2)}
    assert rows.keys() == {"actuation", "design"}
    assert rows["design"].relative_error < 1e-5
    assert rows["design"].gradient_norm > 0.0


def test_the_first_adjoint_that_is_not_finite_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Substep, particle and quantity are given, and the row is not right however well the numbers agree."""
    reverse = Adjoint._reverse

    def spoilt(self: Adjoint, part: Part, first: IntArray) -> None:
        if part.frame == 1:
            self._state.x[0, 0, 7, 1] = float("nan")
        reverse(self, part, first)

    monkeypatch.setattr(Adjoint, "_reverse", spoilt)
    row = next(iter(gradcheck(_case(), (20,))))
    assert not row.is_right
    assert "adjoint of x" in row.fault


def test_horizons_are_reached_in_whole_frames_of_the_steps_taken() -> None:
    """One frame less would fall short; a horizon that the same frame reaches is not done twice."""
    case = _case()
    taken = np.cumsum(case.run(case.base(20)).counts[:, 0])
    reached = case.frames([10, 11, 50])
    assert [int(taken[frames - 1]) >= horizon for frames, horizon in zip(reached, (11, 50), strict=True)] == [True] * 2
    assert int(taken[reached[-1] - 2]) < 50


def test_quotients_replay_the_steps_of_the_base() -> None:
    """A stiffer body, which would choose shorter steps for itself, is run in those that it is given."""
    case = _case()
    base = case.base(6)
    run = case.run(base)
    shorter = replace(run, counts=run.counts + 1)
    stiff = {**base, "stiffness": 1.05 * base["stiffness"]}
    assert np.array_equal(case.run(stiff, shorter).counts, shorter.counts)
    replayed = case.objective_near(base, shorter, "stiffness", 0.05 * base["stiffness"])
    assert replayed == case.objective(case.run(stiff, shorter))
    assert replayed != case.objective(case.run(stiff, run))


def _fake(objective: Callable[[float], float], gradient: float) -> tuple[float, float, float, bool]:
    """The directional check of a function of one number at 0, in the place of an episode."""

    class Function:
        def objective_near(self, *arguments: object) -> float:
            return objective(float(np.asarray(arguments[-1])[0]))

    one = np.ones(1)
    return study._along(Function(), {}, one, "fibres", gradient * one, one, objective(0.0))  # type: ignore[arg-type]


def test_a_kink_is_told_from_a_wrong_gradient() -> None:
    """Quotients to the two sides differ at every width at a kink; a smooth function with a wrong gradient has none."""
    assert _fake(lambda x: np.sin(x) + abs(x), 1.7)[3]
    assert not _fake(np.sin, 1.001)[3]
    exact, difference, error, kinked = _fake(np.sin, 1.0)
    assert (exact, kinked) == (1.0, False)
    assert difference == pytest.approx(1.0, rel=1e-7)
    assert error <= 1e-7


def test_a_direction_that_blows_up_is_wrong_rather_than_an_error() -> None:
    """Not a number from both sides at every width leaves an infinite error."""
    assert _fake(lambda x: np.nan, 1.0)[2] == np.inf


def _row(substeps: int, error: float, norm: float, fault: str = "") -> GradRow:
    return GradRow("ground", "movement-speed", "fibres", 5, substeps, norm, 1.0, 1.0, error, 0.0, fault)


def test_the_summary_names_the_horizon_at_which_chaos_takes_over() -> None:
    """The first horizon where the worst group is off by a percent, and how fast the gradient's norm grows."""
    case = _case()
    rows = [_row(10, 1e-9, 1.0), _row(50, 1e-5, 2.0), _row(200, 2e-2, 2.0 * np.e), _row(800, 1e-3, 2.0 * np.e**2)]
    found = summarise(case, rows)
    assert (found.right_until, found.chaos_from) == (50, 200)
    assert found.error == 1e-5
    assert found.norm_growth == pytest.approx(2.0 * np.e**2)
    assert found.norm_e_fold == pytest.approx(600.0)
    assert summarise(case, rows[:2]).chaos_from is None
    assert found.separation_growth > 0.0


def test_chaos_is_expected_where_a_nudge_would_have_grown_to_a_hundredth_of_a_cell(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Parting by e every 100 substeps, a millionth of a cell takes 921; where nothing parts nothing is expected."""
    case, steps = _case(), np.arange(0, 501, 50)
    monkeypatch.setattr(GradientCase, "separation", lambda *_: (steps, 1e-6 / 32 * np.exp(steps / 100.0)))
    found = summarise(case, [_row(10, 1e-9, 1.0)])
    assert found.separation_e_fold == pytest.approx(100.0)
    assert found.chaos_expected == pytest.approx(100.0 * np.log(1e4))
    monkeypatch.setattr(GradientCase, "separation", lambda *_: (steps, np.exp(-steps / 100.0)))
    assert summarise(case, [_row(10, 1e-9, 1.0)]).chaos_expected is None


def test_a_gradient_that_is_not_finite_is_right_nowhere() -> None:
    """However well the numbers agree."""
    case = _case()
    assert summarise(case, [_row(10, 1e-9, 1.0, "adjoint of x")]).right_until == 0


def test_episodes_that_begin_alike_part_from_the_nudge_on() -> None:
    """The distance begins at a millionth of a cell and is followed frame by frame; without a nudge there is none."""
    case = _case()
    substeps, apart = case.separation(6, np.random.default_rng(0))
    assert apart[0] == pytest.approx(NUDGE / 32, rel=1e-6)
    assert len(substeps) == len(apart) == 7
    assert 0.0 < apart.max() < 1e3 * apart[0]
    still = case.separation(6, np.random.default_rng(0), nudge=0.0)[1]
    assert not still.any()


def test_e_folds_are_fits() -> None:
    """Exponential growth is found, decay and contact with zero are not growth."""
    steps = np.arange(0, 100, 10)
    assert e_fold(steps, 3.0 * np.exp(steps / 25.0)) == pytest.approx(25.0)
    assert e_fold(steps, np.exp(-steps / 25.0)) is None
    assert e_fold(steps, np.zeros(10)) is None
    assert e_fold(np.array([50, 50]), np.ones(2)) is None


@pytest.mark.parametrize("horizons", [(0, 10), ()])
def test_an_empty_horizon_is_refused(horizons: tuple[int, ...]) -> None:
    """Nothing can be said about no substep."""
    with pytest.raises(UsageError, match="Give positive numbers"):
        next(gradcheck(_case(), horizons))


def test_no_direction_is_refused() -> None:
    """Nothing can be said along none."""
    with pytest.raises(UsageError, match="Give at least 1"):
        next(gradcheck(_case(), (10,), directions=0))
