"""The tuna: a spindle with a narrow stem and a sickle-shaped tail fin."""

from zoobench.designs.anatomy import SWIMMER_LENGTH, TAIL, Animal, myomeres, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, ellipsoid, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.043, 0.018, 0.0075, 0.0052),
        (-0.034, 0.018, 0.0076, 0.0052),
        (-0.016, 0.017, 0.0108, 0.0056),
        (0.006, 0.0145, 0.0120, 0.0062),
        (0.030, 0.0145, 0.0085, 0.0065),
        (0.044, 0.0150, 0.0047, 0.0045),
        (0.050, 0.0150, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.032, 0.018), (-0.036, 0.0255), (-0.044, 0.036), (-0.050, 0.036), (-0.0475, 0.025), (-0.047, 0.018),
     (-0.0475, 0.011), (-0.050, 0.0), (-0.044, 0.0), (-0.036, 0.0105)],
    TAIL,
)  # fmt: skip
_BACK_FIN = fin(UPRIGHT, [(0.008, 0.022), (0.001, 0.031), (-0.004, 0.031), (-0.001, 0.022)], TAIL)
_ANAL_FIN = fin(UPRIGHT, [(-0.008, 0.008), (-0.014, 0.002), (-0.018, 0.002), (-0.016, 0.010)], TAIL)
_SIDE_FINS = mirrored(ellipsoid((0.022, 0.0045, 0.0070), (0.009, 0.0045, 0.0050)))


@register(Kind.DESIGN, "tuna", version=5, tags=("primitive", "water"))
def tuna(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A spindle with a sickle-shaped tail fin, 0.15 m long, with eight muscles.

    Flank fibres run along the whole body but the snout, in four segments on each side. Fins have no muscle; that of
    the tail is twice as stiff as muscle, and the others are half as stiff, so that they
    brace the trunk less.

    * `length`: of the whole body [m]; it is 0.36 times as high and 0.24 times as wide, fins included.
    """
    return swimmer(length, 0.036, 0.024, myomeres(_TRUNK), *stiff(_TAIL_FIN), *soft(_BACK_FIN, _ANAL_FIN, _SIDE_FINS))
