"""Every stability case passes; the fast ones here, the others with `pytest -m slow`."""

import pytest

from zoobench_verify.cases import Case
from zoobench_verify.stability.stability_suite import CASES, row_of, stored

SHOWN_ELSEWHERE = {
    "control-beyond-limit": "tests/sim/model/test_step_limits.py, the limit is sharp",
    "inverted-particles": "tests/sim/model/test_diagnostics.py",
    "collapsed-particles": "the same",
    "spray": "water's law in spray in tests/sim/kernels/test_water.py",
    "lone-water": "the same",
    "stretched-bar": "release-from-tension; tests/sim/test_damping.py, a torn robot is noticed",
    "fold": "tests/envs/test_strongest_actuation.py",
    "muscle-flutter": "the same",
    "muscle-near-runaway": "tests/sim/model/test_step_limits.py, the limit is sharp",
    "control-muscle-runaway": "the same",
    "control-too-fast": "tests/sim/test_step_control.py, fast matter shortens the step",
    "all-corners": "on-the-nodes",
    "far-from-origin": "off-the-lattice",
    "object-in-a-corner": "tests/sim/test_objects.py",
    "object-against-a-wall": "the same",
    "gripper-on-nothing": "the same",
    "light-on-heavy": "the same",
    "soft-on-stiff": "tests/sim/test_step_control.py, the stiffest and lightest set the step",
    "light-swimmer": "the conformance suite, a fish in the sea",
    "lone-sand": "the law of torn sand in tests/sim/kernels/test_media.py",
    "drop-on-snow": "tests/envs/test_strongest_actuation.py, on snow",
    "ice-and-glue": "tests/sim/test_adjoint.py, thrust needs friction",
    "fast-landing": "tests/sim/test_step_control.py, fast matter shortens the step",
    "landing-beyond-speed-limit": "the same",
    "flood": "water on a grid survives in tests/envs/test_strongest_actuation.py",
    "muscle-step": "tests/envs/test_strongest_actuation.py",
    "full-strength": "tests/envs/test_strongest_actuation.py",
    "nearly-incompressible": "gravity-column of the validation suite",
}
"""Cases of seconds whose behaviour a fast test shows in little, and which."""


def _is_fast(case: Case) -> bool:
    return case.is_fast and case.name not in SHOWN_ELSEWHERE


@pytest.mark.parametrize(
    "found", [pytest.param(case, id=case.name, marks=() if _is_fast(case) else pytest.mark.slow) for case in CASES]
)
def test_case_passes(found: Case) -> None:
    """All checks are met, and the row has all columns."""
    row = row_of(found.run())
    assert row["verdict"] == "pass", row["measured"]
    assert list(row) == [
        "case", "verdict", "measured", "smallest_j", "step", "step_fraction", "retries", "guarded_share",
        "repeated_share", "seconds",
    ]  # fmt: skip


def test_the_suite_is_large_enough_and_described() -> None:
    """50 cases with names of their own, each with a summary, of which most are fast."""
    assert len({found.name for found in CASES}) == len(CASES) >= 50
    assert all(found.summary.endswith(".") for found in CASES)
    assert sum(found.is_fast for found in CASES) >= 25
    assert {found.name for found in CASES} >= SHOWN_ELSEWHERE.keys()


def test_a_row_is_stored_with_all_measured_quantities() -> None:
    """The document holds every column but the case's name and verdict."""
    row = stored(row_of(next(found for found in CASES if found.name == "one-particle").run()))
    assert (row.case, row.verdict) == ("one-particle", "pass")
    assert {"measured", "smallest_j", "step", "step_fraction", "retries", "guarded_share", "seconds"} <= set(
        row.document
    )
    assert row.document["step"] > 0
