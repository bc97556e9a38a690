"""The orca: a whale that beats its flat tail up and down."""

from zoobench.designs.anatomy import (
    MIDDLE,
    SIDES,
    SWIMMER_LENGTH,
    TAIL,
    Animal,
    crossed,
    myomeres,
    opposed,
    soft,
    stiff,
    swimmer,
)
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_HEIGHT = 0.75 * MIDDLE
_TRUNK = loft(
    [
        (-0.044, _HEIGHT, 0.0052, 0.0060),
        (-0.034, _HEIGHT, 0.0052, 0.0058),
        (-0.016, _HEIGHT, 0.0060, 0.0095),
        (0.004, _HEIGHT, 0.0126, 0.0171),
        (0.020, _HEIGHT, 0.0154, 0.0180),
        (0.036, _HEIGHT, 0.0119, 0.0120),
        (0.046, _HEIGHT, 0.0065, 0.0065),
        (0.050, _HEIGHT, 0.0, 0.0),
    ]
)
_FLUKES = mirrored(
    fin(
        Plane((0.0, _HEIGHT, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        [(-0.031, -0.01), (-0.031, 0.0), (-0.036, 0.0070), (-0.0445, 0.0145), (-0.050, 0.0145), (-0.0485, 0.0060),
         (-0.047, 0.0), (-0.047, -0.01)],
        TAIL,
    )
)  # fmt: skip
# narrow and thin: it stands in the plane of bending, where a broad one would brace the trunk
_BACK_FIN = fin(
    UPRIGHT,
    [(0.014, _HEIGHT + 0.004), (0.005, _HEIGHT + 0.018), (0.000, _HEIGHT + 0.018), (0.002, _HEIGHT + 0.004)],
    0.0075,
)
# they droop: what they brake below the middle, the back fin brakes above it
_FLIPPERS = mirrored(
    fin(
        Plane((0.024, _HEIGHT, 0.0), (1.0, 0.0, 0.0), (0.0, -0.45, 1.0)),
        [(0.007, 0.0), (0.006, 0.020), (0.001, 0.024), (-0.006, 0.024), (-0.008, 0.018), (-0.006, 0.0)],
        TAIL,
    )
)


@register(Kind.DESIGN, "orca", version=7, tags=("primitive", "water"))
def orca(*, length: float = SWIMMER_LENGTH, paired: bool = True) -> Animal:
    """A whale that beats its flat tail up and down in a wave, 0.15 m long, with twelve muscles.

    The fibres of back and belly run along the whole body but the snout, in four segments each; those of the two
    foremost are paired, left and right, and turn it. Trunk and flippers are broad in front, and the stem narrow, so
    that the head swings less than the flukes. The trunk is 0.75 times as stiff as muscle. The flukes, the flippers and
    the fin on the back have no muscle; the flukes are twice as stiff as muscle, and the others are half as stiff, so
    that they brace the trunk less.

    * `length`: of the whole body [m]; it is 0.34 times as high and 0.48 times as wide, fins included.
    * `paired`: whether front muscles are left and right; without, it has eight muscles, and none to turn by [-].
    """
    upright = opposed(("belly", "back"), 1, _HEIGHT - 0.0005, _HEIGHT + 0.0005)
    trunk = myomeres(_TRUNK, upright, front=crossed(upright, SIDES) if paired else None, stiffness=0.75)
    return swimmer(length, 0.0340, 0.0484, trunk, *stiff(_FLUKES), *soft(_BACK_FIN, _FLIPPERS))
