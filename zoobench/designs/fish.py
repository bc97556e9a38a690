"""The fish: a slender swimmer that bends from side to side in a wave."""

from zoobench.designs.anatomy import SWIMMER_LENGTH, TAIL, Animal, BodyPart, myomeres, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, ellipsoid, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, 0.014, 0.0065, 0.0053),
        (-0.024, 0.014, 0.0065, 0.0053),
        (-0.007, 0.014, 0.00925, 0.0069),
        (0.010, 0.014, 0.0120, 0.0085),
        (0.034, 0.014, 0.0072, 0.0072),
        (0.045, 0.014, 0.0043, 0.0043),
        (0.050, 0.014, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.030, 0.014), (-0.034, 0.0196), (-0.043, 0.028), (-0.050, 0.028), (-0.046, 0.014), (-0.050, 0.0), (-0.043, 0.0),
     (-0.034, 0.0084)],
    TAIL,
)  # fmt: skip
# under the stiff head, where they do not hinder bending; with the tail fin they carry the fish out of water
_SIDE_FINS = mirrored(ellipsoid((0.026, 0.0045, 0.0060), (0.009, 0.0045, 0.0045)))


@register(Kind.DESIGN, "fish", version=4, tags=("animal", "water"))
def fish(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A slender swimmer that bends from side to side in a wave, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. The stem of the tail is thin,
    so that the tail swings more than the head. Fins have no muscle; that of the tail is twice as stiff.

    * `length`: of the whole body [m]; it is 0.28 times as high and 0.21 times as wide, fins included.
    """
    return swimmer(length, 0.028, 0.021, myomeres(_TRUNK), *stiff(_TAIL_FIN), BodyPart(solid=_SIDE_FINS))
