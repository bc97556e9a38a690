"""The shark: slender, with a pointed snout and a tail fin whose upper lobe is the longer."""

from zoobench.designs.anatomy import THINNEST, Animal, flanks, paired, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.040, 0.0195, 0.0095, 0.0100),
        (-0.024, 0.0180, 0.0105, 0.0100),
        (-0.006, 0.0155, 0.0130, 0.0115),
        (0.012, 0.0145, 0.0145, 0.0135),
        (0.028, 0.0150, 0.0130, 0.0125),
        (0.040, 0.0165, 0.0100, 0.0105),
        (0.050, 0.0180, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.028, 0.021), (-0.034, 0.030), (-0.046, 0.0495), (-0.050, 0.0495), (-0.044, 0.026), (-0.046, 0.0),
     (-0.039, 0.0), (-0.034, 0.016)],
    THINNEST,
)  # fmt: skip
_BACK_FIN = fin(UPRIGHT, [(0.016, 0.024), (0.002, 0.045), (-0.005, 0.045), (-0.003, 0.024)], THINNEST)
_SIDE_FINS = mirrored(
    fin(
        Plane((0.018, 0.0095, 0.008), (-0.45, -0.10, 1.0), (1.0, 0.0, 0.45)),
        [(-0.004, 0.008), (0.010, 0.006), (0.019, -0.001), (0.018, -0.006), (0.008, -0.009), (-0.004, -0.009)],
        THINNEST,
    )
)


@register(Kind.DESIGN, "shark", version=4, tags=("primitive", "water"))
def shark(*, length: float = 0.10) -> Animal:
    """A slender swimmer that bends from side to side, 0.10 m long, with eight muscles.

    Flank fibres run along the body, in three segments on each side; those of the two pectoral fins run outwards. The
    head, the fin on the back and the tail fin, whose upper lobe is the longer, have no muscle; fins are twice as stiff.

    * `length`: of the whole body [m]; it is half as high and as wide, fins included.
    """
    trunk, fins = flanks(_TRUNK, -0.036, 0.024), paired("fin", _SIDE_FINS, (0.45, 0.10, -1.0))
    return swimmer(length, 0.05, 0.05, trunk, fins, *stiff(_TAIL_FIN, _BACK_FIN))
