"""The clownfish: short and high, with round fins and long ones along back and belly."""

from zoobench.designs.anatomy import MIDDLE, SWIMMER_LENGTH, TAIL, Animal, level, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, above_and_below, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, MIDDLE, 0.0085, 0.0052),
        (-0.035, MIDDLE, 0.0085, 0.0055),
        (-0.016, MIDDLE, 0.0128, 0.0061),
        (0.002, MIDDLE, 0.0172, 0.0100),
        (0.020, MIDDLE, 0.0178, 0.0107),
        (0.036, MIDDLE, 0.0140, 0.0084),
        (0.046, MIDDLE, 0.0085, 0.0050),
        (0.050, MIDDLE, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.033, MIDDLE), (-0.0355, MIDDLE + 0.0069), (-0.040, MIDDLE + 0.0125), (-0.0455, MIDDLE + 0.0116),
     (-0.049, MIDDLE + 0.0062), (-0.050, MIDDLE), (-0.049, MIDDLE - 0.0062), (-0.0455, MIDDLE - 0.0116),
     (-0.040, MIDDLE - 0.0125), (-0.0355, MIDDLE - 0.0069)],
    TAIL,
)  # fmt: skip
# of back and belly, one as the other, so that it is not by one that the clownfish dives or rolls; behind the middle,
# as with fins before it the best gaits leave their course, and on each grid elsewhere
_FINS = above_and_below(
    fin(
        UPRIGHT,
        [(0.012, MIDDLE + 0.014), (0.002, MIDDLE + 0.0195), (-0.016, MIDDLE + 0.0195), (-0.020, MIDDLE + 0.0165),
         (-0.021, MIDDLE + 0.010), (-0.016, MIDDLE + 0.004)],
        TAIL,
    ),
    MIDDLE,
)  # fmt: skip
_SIDE_FINS = mirrored(
    fin(
        level(0.010),
        [(0.008, 0.0), (0.006, 0.0102), (0.000, 0.0136), (-0.006, 0.0136), (-0.010, 0.0093), (-0.008, 0.0)],
        TAIL,
    )
)


@register(Kind.DESIGN, "clownfish", version=9, tags=("primitive", "water"))
def clownfish(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A short, high swimmer with round fins, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. Fins have no muscle; that of
    the tail is twice as stiff as muscle, and the others are half as stiff, so that they brace the trunk less.

    * `length`: of the whole body [m]; it is 0.39 times as high and 0.28 times as wide, fins included.
    """
    trunk = myomeres(_TRUNK)
    return swimmer(length, 0.0417, 0.0276, trunk, *stiff(_TAIL_FIN), *soft(_FINS, _SIDE_FINS))
