"""The clownfish: short and high, with round fins and one long fin along the back."""

from zoobench.designs.anatomy import SWIMMER_LENGTH, TAIL, Animal, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, ellipsoid, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.042, 0.021, 0.0080, 0.0052),
        (-0.034, 0.021, 0.0085, 0.0052),
        (-0.014, 0.0195, 0.0140, 0.0056),
        (0.008, 0.019, 0.0150, 0.0062),
        (0.032, 0.019, 0.0105, 0.0065),
        (0.045, 0.019, 0.0055, 0.0045),
        (0.050, 0.019, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.030, 0.021), (-0.034, 0.029), (-0.040, 0.034), (-0.046, 0.033), (-0.0495, 0.027), (-0.050, 0.021),
     (-0.0495, 0.015), (-0.046, 0.009), (-0.040, 0.008), (-0.034, 0.013)],
    TAIL,
)  # fmt: skip
_BACK_FIN = fin(
    UPRIGHT,
    [(0.016, 0.030), (0.012, 0.037), (0.004, 0.038), (-0.002, 0.037), (-0.010, 0.040), (-0.018, 0.040),
     (-0.023, 0.036), (-0.022, 0.027)],
    TAIL,
)  # fmt: skip
_ANAL_FIN = fin(
    UPRIGHT, [(-0.006, 0.008), (-0.010, 0.001), (-0.016, 0.0), (-0.022, 0.003), (-0.023, 0.010), (-0.018, 0.014)], TAIL
)
_BELLY_FINS = mirrored(ellipsoid((0.018, 0.0050, 0.0085), (0.009, 0.0050, 0.0055)))


@register(Kind.DESIGN, "clownfish", version=5, tags=("primitive", "water"))
def clownfish(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A short, high swimmer with round fins, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. Fins have no muscle; that of
    the tail is twice as stiff as muscle, and the others are half as stiff, so that they
    brace the trunk less.

    * `length`: of the whole body [m]; it is 0.41 times as high and 0.28 times as wide, fins included.
    """
    return swimmer(length, 0.041, 0.028, myomeres(_TRUNK), *stiff(_TAIL_FIN), *soft(_BACK_FIN, _ANAL_FIN, _BELLY_FINS))
