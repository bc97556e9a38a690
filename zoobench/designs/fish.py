"""The fish: a slender swimmer that bends from side to side in a wave."""

from zoobench.designs.anatomy import SWIMMER_LENGTH, TAIL, Animal, BodyPart, myomeres, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, ellipsoid, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, 0.014, 0.0075, 0.0052),
        (-0.034, 0.014, 0.0078, 0.0052),
        (-0.014, 0.014, 0.0108, 0.0056),
        (0.008, 0.014, 0.0114, 0.0062),
        (0.032, 0.014, 0.0074, 0.0065),
        (0.046, 0.014, 0.0050, 0.0050),
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


@register(Kind.DESIGN, "fish", version=5, tags=("animal", "water"))
def fish(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A slender swimmer that bends from side to side in a wave, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. The body is high and narrow
    between a thin stem of the tail and a low head: one as high and wide as the trunk is a paddle, too, and at 2 Hz the
    fish swims backwards. Fins have no muscle; that of the tail is twice as stiff.

    * `length`: of the whole body [m]; it is 0.28 times as high and 0.21 times as wide, fins included.
    """
    return swimmer(length, 0.028, 0.021, myomeres(_TRUNK), *stiff(_TAIL_FIN), BodyPart(solid=_SIDE_FINS))
