"""The shark: a pointed snout, and a tail fin with equal lobes."""

from zoobench.designs.anatomy import MIDDLE, SWIMMER_LENGTH, TAIL, Animal, level, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, above_and_below, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, MIDDLE, 0.0050, 0.0050),
        (-0.034, MIDDLE, 0.0050, 0.0052),
        (-0.016, MIDDLE, 0.0072, 0.0056),
        (0.004, MIDDLE, 0.0112, 0.0096),
        (0.022, MIDDLE, 0.0120, 0.0104),
        (0.036, MIDDLE, 0.0088, 0.0083),
        (0.046, MIDDLE, 0.0060, 0.0050),
        (0.050, MIDDLE, 0.0, 0.0),
    ]
)
# with equal lobes: a longer one above would make it dive
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.033, MIDDLE), (-0.0335, MIDDLE + 0.003), (-0.039, MIDDLE + 0.0071), (-0.0455, MIDDLE + 0.0125),
     (-0.050, MIDDLE + 0.0125), (-0.0485, MIDDLE + 0.0063), (-0.047, MIDDLE), (-0.0485, MIDDLE - 0.0063),
     (-0.050, MIDDLE - 0.0125), (-0.0455, MIDDLE - 0.0125), (-0.039, MIDDLE - 0.0071), (-0.0335, MIDDLE - 0.003)],
    TAIL,
)  # fmt: skip
# of back and belly, one as the other, so that it is not by one that the shark dives or rolls; behind the middle, as
# with fins before it the best gaits leave their course, and on each grid elsewhere
_FINS = above_and_below(
    fin(
        UPRIGHT,
        [(0.0035, MIDDLE + 0.0063), (-0.0065, MIDDLE + 0.0180), (-0.0135, MIDDLE + 0.0180), (-0.0185, MIDDLE + 0.004)],
        TAIL,
    ),
    MIDDLE,
)
_SIDE_FINS = mirrored(
    fin(
        level(0.004),
        [(0.007, 0.0), (0.004, 0.0063), (-0.004, 0.0125), (-0.009, 0.0125), (-0.007, 0.006), (-0.006, 0.0)],
        TAIL,
    )
)


@register(Kind.DESIGN, "shark", version=9, tags=("primitive", "water"))
def shark(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A swimmer with a pointed snout that bends from side to side in a wave, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. Fins have no muscle; that of
    the tail, whose lobes are equal as of a mako, is twice as stiff as muscle, and the others are half as stiff, so that
    they brace the trunk less.

    * `length`: of the whole body [m]; it is 0.36 times as high and 0.25 times as wide, fins included. Where
      others have their underside, it has 0.03 lengths of nothing, as all swimmers have their middle at one height.
    """
    trunk = myomeres(_TRUNK)
    return swimmer(length, 0.0389, 0.0250, trunk, *stiff(_TAIL_FIN), *soft(_FINS, _SIDE_FINS))
