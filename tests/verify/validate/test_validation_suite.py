"""The validation suite: its cases, all within their bounds; the fast ones here, the others with `pytest -m slow`."""

import re

import pytest

from zoobench_verify.cases import Case
from zoobench_verify.validate import conservation
from zoobench_verify.validate.validation_suite import CASES

SHOWN_ELSEWHERE = {
    "gradient-differences": "tests/sim/test_adjoint.py, every group",
    "gradient-muscle": "tests/sim/test_adjoint.py, actuation and fibres",
    "gradient-checkpoints": "tests/sim/test_adjoint.py, every interval",
    "gradient-taylor": "tests/sim/test_adjoint.py, every group; with AFLIP tests/sim/kernels/test_transfer.py",
    "gradient-frictionless": "tests/sim/test_adjoint.py, thrust needs friction",
    "gradient-single": "tests/sim/test_adjoint.py, 32 against 64 bits",
    "incline": "tests/sim/kernels/test_boundary.py, a block slides",
    "muscle-stretch": "tests/sim/test_solver.py, the equilibrium stretch",
    "muscle-pulls": "the same",
    "manufactured-solution": "tests/verify/accuracy/test_analytic.py, with its order",
    "free-fall-single": "tests/sim/test_solver.py, free fall in both precisions",
    "spinning-disc-single": "the same in 64 bits, and tests/sim/test_solver.py",
    "cantilever": "bar-mode",
    "rolling-ball": "tests/sim/test_objects.py, a ball rolls down a slope",
    "bed-friction": "tests/sim/kernels/test_velocity_fields.py, what slides and what sticks",
    "taylor-green-vortex": "tests/sim/kernels/water_grid/test_advection.py, a vortex lasts",
    "vortices-of-a-body": "the same, vortices of a few cells",
    "coasting-ball": "tests/sim/kernels/water_grid/test_immersed.py, a body takes water along and coasts",
    "sinking-ball": "the same, a body sinks or rises by its density",
    "added-mass-of-a-fish": "the same, a body takes water along",
    "drag-of-solids": "tests/sim/test_surface_water.py, a coasting body slows down by its drag",
    "plate-at-incidence": "the same",
    "moment-on-a-spheroid": "the same, and tests/sim/model/test_potential_flow.py",
    "balls-let-go": "the same, a body begins to sink or rise as its added mass lets it",
    "ball-that-coasts": "the same",
    "carangiform-fish": "the same",
    "object-collision": "tests/sim/test_objects.py, momentum stays and energy falls",
    "object-flies": "the conformance suite, an object that is pushed",
    "snow-press": "tests/sim/kernels/test_media.py, laws of the media",
    "sand-shear": "the same",
    "shear-wave": "bar-mode and wall-mode",
    "block-modes": "the same",
    "spinning-disc": "tests/sim/kernels/test_transfer.py, momentum is kept in flight",
    "spinning-disc-apic": "tests/sim/test_solver.py, momenta are kept",
    "rest-frame-muscle": "tests/sim/test_rest_frame.py, the equilibrium stretch",
    "rest-frame-rolling": "rest-frame-incline, friction of what slides; what rolls is a known shortfall",
    "hydrostatic-column": "tests/sim/kernels/test_water.py",
    "rest-frame-bilayer": "tests/sim/test_rest_frame.py, the equilibrium stretch",
    "free-fall": "tests/sim/test_solver.py, free fall in both precisions",
}
"""Cases of seconds whose physics a fast test shows in little, and which."""


def _is_fast(case: Case) -> bool:
    return case.is_fast and case.name not in SHOWN_ELSEWHERE


@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.name, marks=() if _is_fast(case) else pytest.mark.slow) for case in CASES]
)
def test_case_is_within_its_bounds(case: Case) -> None:
    """Every number that the case measures lies within its bound, and a figure shows it."""
    result = case.run()
    assert result.is_met, result.measured
    assert result.seconds > 0
    assert result.figure is not None
    assert result.figure.curves
    assert all(len(curve.x) == len(curve.y) > 1 for curve in result.figure.curves)


def test_wrong_physics_misses_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compared with another gravity, the simulator fails."""
    monkeypatch.setattr(conservation, "GRAVITY", 9.80)
    result = next(case for case in CASES if case.name == "free-fall").run()
    assert "FAILS centre of mass off the discrete path" in result.measured


def test_names_are_unique_and_every_case_names_source_and_resolution() -> None:
    """At least sixteen cases, among them gradients and single precision, each described."""
    names = [case.name for case in CASES]
    assert set(names) >= SHOWN_ELSEWHERE.keys()
    assert len(set(names)) == len(names) >= 16
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", name) for name in names)
    assert all(case.summary and case.source and case.resolution and case.precision in (0, 32, 64) for case in CASES)
    assert sum(name.startswith("gradient-") for name in names) >= 5
    assert {case.precision for case in CASES} == {0, 32, 64}
