"""The tuna: a deep spindle with a narrow stem and a sickle-shaped tail fin."""

from zoobench.designs.anatomy import MIDDLE, SWIMMER_LENGTH, TAIL, Animal, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, above_and_below, ellipsoid, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, MIDDLE, 0.0066, 0.0056),
        (-0.034, MIDDLE, 0.0070, 0.0060),
        (-0.016, MIDDLE, 0.0110, 0.0068),
        (0.004, MIDDLE, 0.0160, 0.0104),
        (0.022, MIDDLE, 0.0168, 0.0112),
        (0.036, MIDDLE, 0.0118, 0.0083),
        (0.046, MIDDLE, 0.0065, 0.0050),
        (0.050, MIDDLE, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.034, MIDDLE), (-0.0385, MIDDLE + 0.0064), (-0.0445, MIDDLE + 0.0190), (-0.050, MIDDLE + 0.0190),
     (-0.0475, MIDDLE + 0.0068), (-0.0465, MIDDLE), (-0.0475, MIDDLE - 0.0068), (-0.050, MIDDLE - 0.0190),
     (-0.0445, MIDDLE - 0.0190), (-0.0385, MIDDLE - 0.0064)],
    TAIL,
)  # fmt: skip
# of back and belly, one as the other, so that it is not by one that the tuna dives or rolls; behind the middle, as
# with fins before it the best gaits leave their course, and on each grid elsewhere
_FINS = above_and_below(
    fin(
        UPRIGHT,
        [(0.003, MIDDLE + 0.008), (-0.005, MIDDLE + 0.0208), (-0.022, MIDDLE + 0.0208), (-0.024, MIDDLE + 0.004)],
        TAIL,
    ),
    MIDDLE,
)
_SIDE_FINS = mirrored(ellipsoid((0.012, MIDDLE, 0.0085), (0.009, 0.0045, 0.0045)))


@register(Kind.DESIGN, "tuna", version=9, tags=("primitive", "water"))
def tuna(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A spindle with a sickle-shaped tail fin on a narrow stem, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. Fins have no muscle; that of
    the tail is twice as stiff as muscle, and the others are half as stiff, so that they brace the trunk less.

    * `length`: of the whole body [m]; it is 0.42 times as high and 0.26 times as wide, fins included.
    """
    trunk = myomeres(_TRUNK)
    return swimmer(length, 0.0417, 0.0270, trunk, *stiff(_TAIL_FIN), *soft(_FINS, _SIDE_FINS))
