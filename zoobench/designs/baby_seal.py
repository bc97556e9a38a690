"""The baby seal: a fat, tapering body with a raised round head and four flippers."""

from zoobench.designs.anatomy import LIGHT, SIDES, SOFT, THINNEST, Animal, BodyPart, crossed, in_a_row, paired, stiff
from zoobench.designs.shapes import Plane, capsule, ellipsoid, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(  # the ground cuts it off, so that it lies on a belly up to four cells of `standard` wide
    [
        (-0.042, 0.0060, 0.0110, 0.0080),
        (-0.028, 0.0090, 0.0160, 0.0150),
        (-0.008, 0.0130, 0.0240, 0.0230),
        (0.010, 0.0145, 0.0265, 0.0240),
        (0.024, 0.0160, 0.0240, 0.0185),
        (0.034, 0.0160, 0.0, 0.0),
    ]
)
_NECK = capsule((0.014, 0.022, 0.0), (0.029, 0.034, 0.0), 0.0170, 0.0150)
_HEAD = ellipsoid((0.030, 0.0385, 0.0), (0.0155, 0.0145, 0.0155))
_SNOUT = ellipsoid((0.0425, 0.0345, 0.0), (0.0075, 0.0065, 0.0085))
_BLUBBER = ellipsoid((-0.008, 0.0290, 0.0), (0.0260, 0.0095, 0.0180))
_FORE = mirrored(
    fin(
        Plane((0.012, 0.0085, 0.018), (-0.45, 0.0, 1.0), (1.0, 0.0, 0.45)),
        [(-0.006, 0.009), (0.010, 0.008), (0.021, 0.003), (0.0235, -0.003), (0.020, -0.008), (0.008, -0.008),
         (-0.006, -0.009)],
        THINNEST,
    )
)  # fmt: skip
_HIND = mirrored(
    fin(
        Plane((-0.030, 0.0085, 0.004), (-1.0, 0.0, 0.55), (0.55, 0.0, 1.0)),
        [(-0.006, -0.005), (0.010, -0.007), (0.018, -0.0085), (0.0205, 0.000), (0.017, 0.007), (0.008, 0.006),
         (-0.006, 0.005)],
        THINNEST,
    )
)  # fmt: skip


@register(Kind.DESIGN, "baby-seal", version=4, tags=("animal", "land"))
def baby_seal(*, length: float = 0.10) -> Animal:
    """A fat crawler on its broad belly with four flippers, 0.10 m long, with ten muscles.

    The fibres of the trunk run along the body, at rear and front on each side, for waves that gallop like a seal. Those
    of the neck run up to the head, those of the flippers outwards. Blubber on the back is soft and light, which keeps
    the body upright in water; the head is twice as stiff. Neither has muscle.

    * `length`: of the whole body [m]; it is half as high and 0.8 as wide, flippers included.
    """
    trunk = crossed(in_a_row(("rear", "front"), -0.036, 0.036), SIDES)
    return Animal(
        box=(0.10, 0.053, 0.08),
        parts=(
            BodyPart(solid=_TRUNK, muscles=trunk),
            paired("neck", _NECK, (0.78, 0.62, 0.0)),
            paired("fore-flipper", _FORE, (0.45, 0.0, -1.0)),
            paired("hind-flipper", _HIND, (1.0, 0.0, -0.55)),
            BodyPart(solid=_BLUBBER, stiffness=SOFT, density_ratio=LIGHT),
            *stiff(_HEAD),
            BodyPart(solid=_SNOUT),
        ),
        neck=0.024,
        rump=-0.028,
        length=length,
    )
