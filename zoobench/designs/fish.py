"""The fish: a trout-like swimmer that bends from side to side."""

from zoobench.designs.anatomy import THINNEST, Animal, flanks, paired, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.040, 0.025, 0.0085, 0.0085),
        (-0.026, 0.0245, 0.0100, 0.0095),
        (-0.008, 0.0215, 0.0165, 0.0135),
        (0.012, 0.0205, 0.0205, 0.0165),
        (0.030, 0.0205, 0.0180, 0.0150),
        (0.042, 0.0205, 0.0115, 0.0105),
        (0.050, 0.0205, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.030, 0.025), (-0.040, 0.037), (-0.050, 0.046), (-0.0475, 0.034), (-0.0425, 0.025), (-0.0475, 0.014),
     (-0.050, 0.0), (-0.044, 0.0), (-0.040, 0.013)],
    THINNEST,
)  # fmt: skip
_BACK_FIN = fin(UPRIGHT, [(0.017, 0.034), (0.010, 0.0495), (-0.006, 0.046), (-0.013, 0.032)], THINNEST)
_ANAL_FIN = fin(UPRIGHT, [(-0.009, 0.012), (-0.021, 0.0), (-0.027, 0.0), (-0.023, 0.018)], THINNEST)
# low and wide, so that they support the fish out of water
_SIDE_FINS = mirrored(
    fin(
        Plane((0.020, 0.010, 0.010), (-0.35, -0.10, 1.0), (1.0, 0.0, 0.35)),
        [(-0.004, 0.007), (0.014, 0.003), (0.0165, -0.004), (0.013, -0.011), (-0.004, -0.009)],
        THINNEST,
    )
)


@register(Kind.DESIGN, "fish", version=3, tags=("animal", "water"))
def fish(*, length: float = 0.10) -> Animal:
    """A swimmer that bends from side to side, 0.10 m long, with eight muscles.

    Flank fibres run along the body, in three segments on each side, for waves of lateral bending. Those of the two
    pectoral fins run outwards. The head and the other fins have no muscle; fins are twice as stiff.

    * `length`: of the whole body [m]; it is half as high and as wide, fins included.
    """
    trunk, fins = flanks(_TRUNK, -0.036, 0.024), paired("fin", _SIDE_FINS, (0.35, 0.10, -1.0))
    return swimmer(length, trunk, fins, *stiff(_TAIL_FIN, _BACK_FIN, _ANAL_FIN))
