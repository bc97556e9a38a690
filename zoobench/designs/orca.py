"""The orca: a whale that beats its flat tail up and down."""

from zoobench.designs.anatomy import SWIMMER_LENGTH, TAIL, Animal, myomeres, opposed, soft, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.044, 0.0065, 0.0052, 0.0075),
        (-0.034, 0.0065, 0.0052, 0.0078),
        (-0.014, 0.0065, 0.0054, 0.0108),
        (0.008, 0.0065, 0.0059, 0.0114),
        (0.032, 0.0065, 0.0060, 0.0080),
        (0.045, 0.0065, 0.0048, 0.0050),
        (0.050, 0.0065, 0.0, 0.0),
    ]
)
_FLUKES = mirrored(
    fin(
        Plane((0.0, 0.0065, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        [(-0.030, -0.01), (-0.030, 0.0), (-0.034, 0.0070), (-0.042, 0.0175), (-0.050, 0.0175), (-0.050, 0.0070),
         (-0.048, 0.0), (-0.048, -0.01)],
        TAIL,
    )
)  # fmt: skip
# narrow and thin: it stands in the plane of bending, where a broad one would brace the trunk
_BACK_FIN = fin(UPRIGHT, [(0.012, 0.010), (0.004, 0.0245), (0.000, 0.0245), (0.002, 0.010)], 0.0075)
_FLIPPERS = mirrored(
    fin(
        Plane((0.022, 0.00525, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        [(0.006, 0.0), (0.005, 0.010), (0.001, 0.0165), (-0.005, 0.0170), (-0.007, 0.012), (-0.005, 0.0)],
        TAIL,
    )
)


@register(Kind.DESIGN, "orca", version=5, tags=("primitive", "water"))
def orca(*, length: float = SWIMMER_LENGTH) -> Animal:
    """A whale that beats its flat tail up and down in a wave, 0.15 m long, with eight muscles.

    The fibres of back and belly run along the whole body but the snout, in four segments each. The flukes, the
    flippers and the fin on the back have no muscle; the flukes are twice as stiff as muscle, and the others are half as
    stiff, so that they brace the trunk less.

    * `length`: of the whole body [m]; it is 0.25 times as high and 0.35 times as wide, fins included.
    """
    trunk = myomeres(_TRUNK, sides=opposed(("belly", "back"), 1, 0.0060, 0.0070))
    return swimmer(length, 0.0245, 0.035, trunk, *stiff(_FLUKES), *soft(_BACK_FIN, _FLIPPERS))
