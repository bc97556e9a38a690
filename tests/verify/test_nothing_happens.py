"""A case that passes on a simulator in which nothing happens measures nothing."""

from typing import Any

import pytest

from zoobench.sim.launcher import Launcher
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.state import Matter
from zoobench.sim.rest_frame_launcher import RestFrameLauncher
from zoobench_verify.cases import Case
from zoobench_verify.stability import stability_suite
from zoobench_verify.validate import validation_suite

AT_REST = {
    "bad-matter": "refused before it runs",
    "bad-actuation": "refused before it runs",
    "control-unsafe-step": "refused before it runs",
    "control-too-fast": "the speed that it begins with is flagged",
    "inverted-particles": "the state that it begins with is named",
    "equal-stretches": "the reverse of a single substep, which needs no motion",
}
"""Cases that are not about what happens, and why."""

QUICK = {
    "spinning-disc",
    "taylor-green-vortex",
    "lone-elastic",
    "stretched-bar",
    "on-the-nodes",
}

CASES = [case for case in (*validation_suite.CASES, *stability_suite.CASES) if case.name not in AT_REST]


def _stand_still(self: Launcher, matter: Matter, _parameters: Any, plan: LaunchPlan, stride: int) -> None:
    """Every planned substep leaves the state as it is."""
    self._note("forward", plan)
    for world, (first, count) in enumerate(plan._on_host[0][:, :2].tolist() if stride else ()):
        for slot in range(first, first + count * stride, stride):
            for tensor in matter.tensors():
                tensor[slot + stride, world] = tensor[slot, world]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.name, marks=() if case.name in QUICK else pytest.mark.slow) for case in CASES]
)
def test_a_case_fails_where_nothing_happens(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """At least one of its bounds is missed by matter that stays as it begins."""
    for launcher in (Launcher, RestFrameLauncher):
        monkeypatch.setattr(launcher, "advance", _stand_still)
    assert case.run().verdict == "fail"


def test_cases_that_need_no_motion_exist() -> None:
    """The list names no case that is gone."""
    names = {case.name for case in (*validation_suite.CASES, *stability_suite.CASES)}
    assert names >= AT_REST.keys() | QUICK
