"""The panda: a round body and head on four stout legs."""

from zoobench.designs.anatomy import SIDES, Animal, BodyPart, crossed, opposed, soft, stiff, whole
from zoobench.designs.shapes import capsule, ellipsoid, mirrored
from zoobench.registry import Kind, register

_TRUNK = ellipsoid((-0.014, 0.032, 0.0), (0.035, 0.0210, 0.0235))
_BELLY = ellipsoid((-0.016, 0.0185, 0.0), (0.022, 0.0105, 0.0165))
_HEAD = ellipsoid((0.029, 0.038, 0.0), (0.0180, 0.0175, 0.0205))
_SNOUT = ellipsoid((0.044, 0.0335, 0.0), (0.0060, 0.0065, 0.0080))
_EARS = mirrored(ellipsoid((0.026, 0.0520, 0.0160), (0.0080, 0.0080, 0.0080)))
_LEG_X = {"fore": 0.010, "hind": -0.037}


def _leg(end: str) -> BodyPart:
    """A pair of legs: the muscle before the bone swings the foot forward, that behind it swings it back.

    The ground cuts it off where it is widest: paws of 26 mm are two and a half cells wide at `standard`.
    """
    x = _LEG_X[end]
    halves = opposed((f"{end}-back", f"{end}-front"), 0, x - 0.006, x + 0.006)
    return BodyPart(
        solid=mirrored(capsule((x, 0.024, 0.0165), (x, 0.0, 0.0170), 0.0130, 0.0130)),
        muscles=crossed(halves, SIDES),
        fibre=(0.0, -1.0, 0.14),
    )


@register(Kind.DESIGN, "panda", version=4, tags=("animal", "land"))
def panda(*, length: float = 0.10) -> Animal:
    """A walker on four stout legs, 0.10 m long, with ten muscles.

    Each leg has a muscle at the front and one at the back with fibres along the leg, which swing it as antagonists and
    shorten it together. Two long muscles bend the back to either side. The belly is soft, the head twice as stiff;
    neither has muscle.

    * `length`: of the whole body [m]; it is 0.6 as high and as wide.
    """
    back = crossed(whole("back"), SIDES)
    return Animal(
        box=(0.10, 0.06, 0.06),
        parts=(
            _leg("hind"),
            _leg("fore"),
            BodyPart(solid=_TRUNK, muscles=back),
            *soft(_BELLY),
            *stiff(_HEAD),
            BodyPart(solid=_SNOUT),
            BodyPart(solid=_EARS),
        ),
        neck=0.018,
        rump=-0.034,
        blend=0.004,
        length=length,
    )
