"""The fish: high before the middle and narrow, a swimmer that bends from side to side in a wave."""

from zoobench.designs.anatomy import MIDDLE, SWIMMER_LENGTH, TAIL, Animal, BodyPart, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, above_and_below, ellipsoid, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, MIDDLE, 0.0055, 0.0052),
        (-0.034, MIDDLE, 0.0058, 0.0052),
        (-0.016, MIDDLE, 0.0090, 0.0056),
        (0.006, MIDDLE, 0.0148, 0.0092),
        (0.026, MIDDLE, 0.0152, 0.0102),
        (0.040, MIDDLE, 0.0120, 0.0082),
        (0.047, MIDDLE, 0.0070, 0.0050),
        (0.050, MIDDLE, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.030, MIDDLE), (-0.034, MIDDLE + 0.0056), (-0.043, MIDDLE + 0.013), (-0.050, MIDDLE + 0.013), (-0.046, MIDDLE),
     (-0.050, MIDDLE - 0.013), (-0.043, MIDDLE - 0.013), (-0.034, MIDDLE - 0.0056)],
    TAIL,
)  # fmt: skip
# of back and belly, one as the other, so that it is not by one that the fish dives or rolls; behind the middle, as
# with fins before it the best gaits leave their course, and on each grid elsewhere
_FINS = above_and_below(
    fin(
        UPRIGHT,
        [(0.0042, MIDDLE + 0.010), (-0.0038, MIDDLE + 0.0206), (-0.0158, MIDDLE + 0.0206), (-0.0178, MIDDLE + 0.004)],
        TAIL,
    ),
    MIDDLE,
)
# at the height of the middle: below it they would make the fish dive
_SIDE_FINS = mirrored(ellipsoid((0.0125, MIDDLE, 0.0085), (0.009, 0.0045, 0.0045)))


@register(Kind.DESIGN, "fish", version=8, tags=("animal", "water"))
def fish(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A swimmer that bends from side to side in a wave, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. The body is deepest before the
    middle and ends in a thin stem: the water beside a deep front holds the head while the tail swings, and of a body as
    deep behind as in front the head swings as far as the tail. Fins behind the middle hold it on its course. Above and
    below it is the same, so that it does not dive. The fin of the tail is twice as stiff as muscle, those of back and
    belly are half as stiff, and the side fins are as muscle.

    * `length`: of the whole body [m]; it is 0.42 times as high and 0.26 times as wide, fins included.
    """
    trunk = myomeres(_TRUNK)
    return swimmer(length, 0.0417, 0.0264, trunk, *stiff(_TAIL_FIN), *soft(_FINS), BodyPart(solid=_SIDE_FINS))
