"""A robot in its rest frame on the ground: the impact of a sphere, a block on an incline, and a ball that rolls."""

from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.friction import check_inclines
from zoobench_verify.validate.hertz import check_impacts
from zoobench_verify.validate.object_contacts import FRICTIONS, check_rolling

_DENT = "the dent is less than a cell deep, and a grid resists dents that it cannot resolve"
_RINGS = f"{_DENT}; the lowest cells ring, which nothing damps"
_STIFF = {
    8: {"duration": Shortfall(_DENT, 0.82), "force": Shortfall(_RINGS, 1.28)},
    4: {"duration": Shortfall(_DENT, 0.77), "force": Shortfall(_RINGS, 1.96)},
}
"""By the sphere's radius in cells."""

_WORST = {4: (0.81, 0.7, 0.24, -0.06), 6: (0.9, 0.82, 0.62, 0.28), 8: (0.92, 0.86, 0.71, 0.49)}
"""By the cells across a ball, for each coefficient of friction."""
_BRAKES = "friction acts on nodes above the surface, too, against their own velocity, and brakes what rolls"
_BRAKED = {
    (cells, friction): Shortfall(_BRAKES, worst)
    for cells, row in _WORST.items()
    for friction, worst in zip(FRICTIONS, row, strict=True)
}


@case(
    "rest-frame-impact",
    "Hertz 1882; Johnson 1985, Contact mechanics, 11.4",
    "radius of 8 cells, and of 4",
    is_fast=False,
)
def impact(record: CaseRecorder) -> None:
    """Duration, largest force and restitution of the impact of an elastic sphere in its rest frame."""
    check_impacts(record, _STIFF, "lagrangian")


@case("rest-frame-incline", "Coulomb 1785: a = g (sin θ - μ cos θ), at rest for tan θ < μ", "block of 6 x 3 x 3 cells")
def incline(record: CaseRecorder) -> None:
    """A block in its rest frame on an incline rests below the critical angle and slides as Coulomb's law says above."""
    check_inclines(record, "lagrangian")


@case(
    "rest-frame-rolling", "a = 5/7 g sin θ of a ball that rolls down a slope", "ball of 4, 6 and 8 cells", precision=32
)
def rolling_ball(record: CaseRecorder) -> None:
    """A ball in its rest frame rolls down a slope of 10°, whatever the friction that keeps it from sliding."""
    check_rolling(record, _BRAKED, "lagrangian")
