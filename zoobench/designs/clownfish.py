"""The clownfish: short and high, with round fins and one long fin along the back."""

from zoobench.designs.anatomy import THINNEST, Animal, flanks, paired, stiff, swimmer
from zoobench.designs.shapes import UPRIGHT, Plane, fin, loft, mirrored
from zoobench.registry import Kind, register

_TRUNK = loft(
    [
        (-0.038, 0.0240, 0.0100, 0.0085),
        (-0.026, 0.0235, 0.0125, 0.0095),
        (-0.008, 0.0215, 0.0190, 0.0135),
        (0.014, 0.0205, 0.0205, 0.0160),
        (0.032, 0.0205, 0.0180, 0.0145),
        (0.044, 0.0205, 0.0115, 0.0100),
        (0.050, 0.0205, 0.0, 0.0),
    ]
)
_TAIL_FIN = fin(
    UPRIGHT,
    [(-0.032, 0.024), (-0.036, 0.034), (-0.042, 0.039), (-0.048, 0.036), (-0.050, 0.024), (-0.048, 0.012),
     (-0.042, 0.009), (-0.036, 0.014)],
    THINNEST,
)  # fmt: skip
_BACK_FIN = fin(
    UPRIGHT,
    [(0.024, 0.034), (0.016, 0.046), (0.006, 0.0455), (0.000, 0.0435), (-0.008, 0.0495), (-0.018, 0.0475),
     (-0.026, 0.039), (-0.024, 0.028)],
    THINNEST,
)  # fmt: skip
_ANAL_FIN = fin(
    UPRIGHT, [(-0.006, 0.010), (-0.012, 0.001), (-0.022, 0.002), (-0.028, 0.010), (-0.024, 0.018)], THINNEST
)
_SIDE_FINS = mirrored(
    fin(
        Plane((0.020, 0.0105, 0.010), (-0.25, -0.12, 1.0), (1.0, 0.0, 0.25)),
        [(-0.004, 0.009), (0.007, 0.009), (0.013, 0.005), (0.0148, -0.001), (0.013, -0.007), (0.007, -0.011),
         (-0.004, -0.011)],
        THINNEST,
    )
)  # fmt: skip


@register(Kind.DESIGN, "clownfish", version=4, tags=("primitive", "water"))
def clownfish(*, length: float = 0.10) -> Animal:
    """A short, high swimmer with round fins, 0.10 m long, with eight muscles.

    Flank fibres run along the body, in three segments on each side; those of the two pectoral fins run outwards. The
    head and the other fins have no muscle; fins are twice as stiff.

    * `length`: of the whole body [m]; it is half as high and as wide, fins included.
    """
    trunk, fins = flanks(_TRUNK, -0.034, 0.026), paired("fin", _SIDE_FINS, (0.25, 0.12, -1.0))
    return swimmer(length, 0.05, 0.05, trunk, fins, *stiff(_TAIL_FIN, _BACK_FIN, _ANAL_FIN))
