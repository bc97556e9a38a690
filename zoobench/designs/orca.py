"""The orca: a whale that beats its flat tail up and down."""

from zoobench.designs.anatomy import THINNEST, Animal, BodyPart, crossed, in_a_row, opposed, paired, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.042, 0.0160, 0.0095, 0.0100),
        (-0.026, 0.0165, 0.0110, 0.0115),
        (-0.008, 0.0165, 0.0155, 0.0150),
        (0.012, 0.0165, 0.0175, 0.0175),
        (0.030, 0.0165, 0.0155, 0.0155),
        (0.043, 0.0155, 0.0110, 0.0105),
        (0.050, 0.0150, 0.0, 0.0),
    ]
)
_FLUKES = mirrored(
    fin(
        Plane((0.0, 0.016, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        [(-0.030, 0.0), (-0.036, 0.008), (-0.046, 0.0245), (-0.050, 0.0245), (-0.049, 0.012), (-0.046, 0.0),
         (-0.046, -0.01), (-0.030, -0.01)],
        THINNEST,
    )
)  # fmt: skip
_BACK_FIN = fin(
    UPRIGHT, [(0.014, 0.030), (0.001, 0.0495), (-0.007, 0.0495), (-0.006, 0.040), (-0.006, 0.028)], THINNEST
)
_FLIPPERS = mirrored(
    fin(
        Plane((0.024, 0.0095, 0.0095), (-0.35, -0.15, 1.0), (1.0, 0.0, 0.35)),
        [(-0.004, 0.007), (0.012, 0.0075), (0.0145, 0.0045), (0.0142, -0.005), (0.008, -0.010), (-0.004, -0.008)],
        THINNEST,
    )
)


@register(Kind.DESIGN, "orca", version=4, tags=("primitive", "water"))
def orca(*, length: float = 0.10) -> Animal:
    """A whale that beats its flat tail up and down, 0.10 m long, with eight muscles.

    The fibres of back and belly run along the body, in three segments each, for waves of dorsoventral bending. Those of
    the two flippers run outwards, for steering. The head, the flukes and the tall fin on the back have no muscle; fins
    are twice as stiff.

    * `length`: of the whole body [m]; it is half as high and as wide, fins included.
    """
    rows = in_a_row(("segment-1", "segment-2", "segment-3"), -0.038, 0.026)
    trunk = BodyPart(solid=_TRUNK, muscles=crossed(rows, opposed(("belly", "back"), 1, 0.009, 0.025)))
    flippers = paired("flipper", _FLIPPERS, (0.35, 0.15, -1.0))
    return swimmer(length, 0.05, 0.05, trunk, flippers, *stiff(_FLUKES, _BACK_FIN))
