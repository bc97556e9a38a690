"""The shark: slender, with a pointed snout and a tail fin whose upper lobe is the longer."""

from zoobench.designs.anatomy import SWIMMER_LENGTH, TAIL, Animal, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.043, 0.0165, 0.0075, 0.0052),
        (-0.034, 0.0155, 0.0078, 0.0052),
        (-0.014, 0.0135, 0.0103, 0.0056),
        (0.008, 0.0125, 0.0110, 0.0062),
        (0.032, 0.0130, 0.0074, 0.0065),
        (0.045, 0.0140, 0.0043, 0.0045),
        (0.050, 0.0150, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.029, 0.019), (-0.036, 0.026), (-0.045, 0.038), (-0.050, 0.038), (-0.048, 0.024), (-0.047, 0.014),
     (-0.048, 0.0), (-0.041, 0.0), (-0.033, 0.010)],
    TAIL,
)  # fmt: skip
_BACK_FIN = fin(UPRIGHT, [(0.014, 0.019), (0.003, 0.0355), (-0.003, 0.0355), (-0.001, 0.019)], TAIL)
_SIDE_FINS = mirrored(
    fin(
        Plane((0.020, 0.0055, 0.0), (1.0, 0.0, 0.0), (0.0, -0.06, 1.0)),
        [(0.006, 0.0), (0.004, 0.008), (-0.006, 0.0165), (-0.010, 0.0165), (-0.006, 0.006), (-0.006, 0.0)],
        TAIL,
    )
)


@register(Kind.DESIGN, "shark", version=5, tags=("primitive", "water"))
def shark(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A slender swimmer that bends from side to side in a wave, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. Fins have no muscle; that of
    the tail, whose upper lobe is the longer, is twice as stiff as muscle, and the others are half as stiff, so that
    they brace the trunk less.

    * `length`: of the whole body [m]; it is 0.38 times as high and 0.33 times as wide, fins included.
    """
    return swimmer(length, 0.038, 0.033, myomeres(_TRUNK), *stiff(_TAIL_FIN), *soft(_BACK_FIN, _SIDE_FINS))
