"""The orca: a whale that beats its flat tail up and down."""

from zoobench.designs.anatomy import (
    MIDDLE,
    SIDES,
    SWIMMER_LENGTH,
    TAIL,
    Animal,
    BodyPart,
    crossed,
    level,
    myomeres,
    opposed,
    soft,
    stiff,
    swimmer,
)
from zoobench.designs.shapes import UPRIGHT, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, MIDDLE, 0.0047, 0.0060),
        (-0.034, MIDDLE, 0.0047, 0.0058),
        (-0.016, MIDDLE, 0.0056, 0.0095),
        (0.004, MIDDLE, 0.0100, 0.0160),
        (0.022, MIDDLE, 0.0115, 0.0168),
        (0.036, MIDDLE, 0.0095, 0.0118),
        (0.046, MIDDLE, 0.0065, 0.0065),
        (0.050, MIDDLE, 0.0, 0.0),
    ]
)
_FLUKES = mirrored(
    fin(
        level(0.0),
        [(-0.031, -0.01), (-0.031, 0.0), (-0.036, 0.0070), (-0.0445, 0.0160), (-0.050, 0.0160), (-0.0485, 0.0060),
         (-0.047, 0.0), (-0.047, -0.01)],
        TAIL,
    )
)  # fmt: skip
# on a short base and very soft: it stands in the plane of bending, and one that braces the trunk does so more on fine
# grids than on coarse ones
_BACK_FIN = BodyPart(
    solid=fin(
        UPRIGHT,
        [(0.015, MIDDLE + 0.010), (0.006, MIDDLE + 0.0165), (0.003, MIDDLE + 0.0165), (0.009, MIDDLE + 0.010)],
        0.0075,
    ),
    stiffness=0.05,
)
# level with the middle: where they droop, the orca dives; and so far behind it, as with them further ahead it pitches,
# and on each grid otherwise, and further behind slow waves hardly move it
_FLIPPERS = mirrored(
    fin(
        level(-0.0115),
        [(0.009, 0.0), (0.004, 0.0175), (0.0, 0.0206), (-0.006, 0.0206), (-0.008, 0.0165), (-0.006, 0.0)],
        TAIL,
    )
)


@register(Kind.DESIGN, "orca", version=11, tags=("primitive", "water"))
def orca(*, length: float = SWIMMER_LENGTH, paired: bool = False) -> Animal:
    """A whale that beats its flat tail up and down in a wave, 0.15 m long, with eight muscles.

    The fibres of back and belly run along the whole body but the snout, in four segments each. The trunk is broad
    in front, and the stem narrow, so that the head swings less than the flukes; the flippers are behind the middle, so
    that it holds its course. But for the fin on the back it is the same above and below the middle, so that it does not
    dive. The flukes, the flippers and the fin on the back have no muscle; they are 2, 0.5 and 0.05 times as stiff as
    muscle, the softer the less they brace the trunk.

    * `length`: of the whole body [m]; it is 0.28 times as high and 0.41 times as wide, fins included. Where others have
      their underside, it has 0.09 lengths of nothing, as all swimmers have their middle at one height.
    * `paired`: whether the two foremost segments have muscles left and right, twelve in all, by which it can turn. By
      those it rolls over, too, and gaits that use them go elsewhere on each grid [-].
    """
    upright = opposed(("belly", "back"), 1, MIDDLE - 0.0005, MIDDLE + 0.0005)
    trunk = myomeres(_TRUNK, upright, front=crossed(upright, SIDES) if paired else None)
    return swimmer(length, 0.0373, 0.0412, trunk, *stiff(_FLUKES), _BACK_FIN, *soft(_FLIPPERS))
