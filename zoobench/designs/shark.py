"""The shark: a pointed snout, a high back fin and a tail fin whose upper lobe is the longer."""

from zoobench.designs.anatomy import MIDDLE, SWIMMER_LENGTH, TAIL, Animal, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_HEIGHT = 0.75 * MIDDLE
_TRUNK = loft(
    [
        (-0.044, _HEIGHT, 0.0050, 0.0050),
        (-0.034, _HEIGHT, 0.0050, 0.0052),
        (-0.016, _HEIGHT, 0.0085, 0.0056),
        (0.004, _HEIGHT, 0.0144, 0.0096),
        (0.022, _HEIGHT, 0.0155, 0.0104),
        (0.036, _HEIGHT, 0.0108, 0.0083),
        (0.046, _HEIGHT, 0.0060, 0.0050),
        (0.050, _HEIGHT, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.033, _HEIGHT + 0.003), (-0.039, _HEIGHT + 0.009), (-0.0455, _HEIGHT + 0.0145), (-0.050, _HEIGHT + 0.0145),
     (-0.0485, _HEIGHT + 0.008), (-0.047, _HEIGHT), (-0.0475, _HEIGHT - 0.0120), (-0.0425, _HEIGHT - 0.0120),
     (-0.037, _HEIGHT - 0.005), (-0.033, _HEIGHT - 0.003)],
    TAIL,
)  # fmt: skip
_BACK_FIN = fin(
    UPRIGHT,
    [(0.018, _HEIGHT + 0.010), (0.008, _HEIGHT + 0.0200), (0.002, _HEIGHT + 0.0200), (0.004, _HEIGHT + 0.009)],
    TAIL,
)  # fmt: skip
# a counterweight to the back fin, by which the shark would roll and dive
_BELLY_FIN = fin(
    UPRIGHT,
    [(0.008, _HEIGHT - 0.009), (0.000, _HEIGHT - 0.0150), (-0.004, _HEIGHT - 0.0150), (-0.002, _HEIGHT - 0.006)],
    TAIL,
)  # fmt: skip
_SIDE_FINS = mirrored(
    fin(
        Plane((0.016, _HEIGHT - 0.004, 0.0), (1.0, 0.0, 0.0), (0.0, -0.35, 1.0)),
        [(0.007, 0.0), (0.004, 0.008), (-0.004, 0.0146), (-0.009, 0.0146), (-0.007, 0.006), (-0.006, 0.0)],
        TAIL,
    )
)


@register(Kind.DESIGN, "shark", version=6, tags=("primitive", "water"))
def shark(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A swimmer with a pointed snout that bends from side to side in a wave, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. Fins have no muscle; that of
    the tail, whose upper lobe is the longer, is twice as stiff as muscle, and the others are half as stiff, so that
    they brace the trunk less.

    * `length`: of the whole body [m]; it is 0.36 times as high and 0.31 times as wide, fins included.
    """
    trunk = myomeres(_TRUNK)
    return swimmer(length, 0.0360, 0.0310, trunk, *stiff(_TAIL_FIN), *soft(_BACK_FIN, _BELLY_FIN, _SIDE_FINS))
