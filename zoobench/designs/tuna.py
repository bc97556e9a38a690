"""The tuna: a spindle with a narrow stem and a sickle-shaped tail fin."""

from zoobench.designs.anatomy import THINNEST, Animal, flanks, paired, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.042, 0.0230, 0.0095, 0.0095),
        (-0.032, 0.0225, 0.0095, 0.0095),
        (-0.014, 0.0195, 0.0135, 0.0120),
        (0.008, 0.0175, 0.0175, 0.0165),
        (0.028, 0.0180, 0.0160, 0.0145),
        (0.041, 0.0190, 0.0100, 0.0095),
        (0.050, 0.0200, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.033, 0.023), (-0.038, 0.037), (-0.046, 0.0495), (-0.050, 0.0495), (-0.0465, 0.036), (-0.0445, 0.023),
     (-0.0465, 0.010), (-0.050, 0.0), (-0.046, 0.0), (-0.038, 0.009)],
    THINNEST,
)  # fmt: skip
_BACK_FINS = (
    fin(UPRIGHT, [(0.022, 0.030), (0.014, 0.045), (0.005, 0.041), (0.007, 0.030)], THINNEST),
    fin(UPRIGHT, [(-0.002, 0.030), (-0.013, 0.043), (-0.0215, 0.043), (-0.0205, 0.028)], THINNEST),
)
_ANAL_FIN = fin(UPRIGHT, [(-0.006, 0.010), (-0.014, -0.002), (-0.021, -0.002), (-0.018, 0.014)], THINNEST)
_SIDE_FINS = mirrored(
    fin(
        Plane((0.022, 0.0100, 0.009), (-0.60, -0.10, 1.0), (1.0, 0.0, 0.60)),
        [(-0.004, 0.006), (0.010, 0.005), (0.0195, -0.001), (0.019, -0.005), (0.008, -0.008), (-0.004, -0.009)],
        THINNEST,
    )
)


@register(Kind.DESIGN, "tuna", version=4, tags=("primitive", "water"))
def tuna(*, length: float = 0.10) -> Animal:
    """A spindle with a sickle-shaped tail fin, 0.10 m long, with eight muscles.

    Flank fibres run along the body, in three segments on each side; those of the two pectoral fins run outwards. The
    head and the other fins have no muscle; fins are twice as stiff.

    * `length`: of the whole body [m]; it is half as high and as wide, fins included.
    """
    trunk, fins = flanks(_TRUNK, -0.036, 0.024), paired("fin", _SIDE_FINS, (0.60, 0.10, -1.0))
    return swimmer(length, 0.05, 0.05, trunk, fins, *stiff(_TAIL_FIN, *_BACK_FINS, _ANAL_FIN))
