"""The check of gradients must be able to fail."""

from dataclasses import replace

import pytest

from zoobench.errors import UsageError
from zoobench.sim.adjoint import Adjoint
from zoobench.sim.rollout import FloatArray, Gradient
from zoobench.spec import Ref
from zoobench.studies.gradcheck import GROUPS, gradcheck

CELL = ([Ref("ground")], [Ref("movement-speed")])


def test_a_wrong_gradient_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """An adjoint off by a tenth of a percent in one group is wrong there, and only there."""
    run = Adjoint.run

    def spoilt(self: Adjoint, *pulls: FloatArray) -> Gradient:
        gradient = run(self, *pulls)
        return replace(gradient, stiffness=1.001 * gradient.stiffness)

    monkeypatch.setattr(Adjoint, "run", spoilt)
    verdicts = {row.group: row.is_right for row in gradcheck(*CELL, horizons=(20,))}
    assert verdicts == {group: group != "stiffness" for group in GROUPS}


def test_the_first_adjoint_that_is_not_finite_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Substep, particle and quantity are given, and the row is not right however well the numbers agree."""
    seed = Adjoint._seed

    def spoilt(self: Adjoint, frame: int, *pulls: FloatArray) -> None:
        seed(self, frame, *pulls)
        if frame == 2:
            self._state.x[0, 0, 7, 1] = float("nan")

    monkeypatch.setattr(Adjoint, "_seed", spoilt)
    row = next(iter(gradcheck(*CELL, horizons=(20,))))
    assert not row.is_right
    assert "adjoint of x" in row.fault


def test_an_empty_horizon_is_refused() -> None:
    """Nothing can be said about no substep."""
    with pytest.raises(UsageError, match="Give positive numbers"):
        next(gradcheck(*CELL, horizons=(0, 10)))
