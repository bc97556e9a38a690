"""Mud in shear: a film that runs down an incline, against Bingham's law."""

import math
from typing import NamedTuple

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.granular import Layer
from zoobench_verify.validate.rig import GRAVITY

_DENSITY, _VISCOSITY = 1000.0, 20.0
_SLOPE = math.radians(10)
_PLUG = 0.5
"""Share of the depth in which the stress is below the yield stress."""


def _mud(depth: float) -> MudMaterial:
    """Mud that yields below `_PLUG` of its depth on the slope, and settles by about half a per cent under its weight.

    In simple shear the norm of the deviator is sqrt2 times the shear stress.
    """
    bound = _PLUG * _DENSITY * GRAVITY * math.sin(_SLOPE) * depth
    stiffness = 300 * _DENSITY * GRAVITY * depth
    return MudMaterial(stiffness, 0.2, _DENSITY, yield_stress=math.sqrt(2) * bound, viscosity=_VISCOSITY)


def bingham_film(height: Array, depth: float) -> Array:
    """Speeds [m/s] at heights [m] in a film of `_mud` (Bingham 1922): a parabola, and above it a plug."""
    sheared = (1 - _PLUG) * depth
    y = np.minimum(height, sheared)
    speed: Array = _DENSITY * GRAVITY * math.sin(_SLOPE) / _VISCOSITY * (sheared * y - y**2 / 2)
    return speed


class MudFlow(NamedTuple):
    """Heights [m] and speeds [m/s] of the particles of a simulated film `[count]`, and the exact speeds."""

    height: Array
    speed: Array
    exact: Array

    @property
    def surface(self) -> float:
        """Speed of the plug over Bingham's."""
        return float(self.speed[-1] / self.exact[-1])


def film(cells: int) -> MudFlow:
    """A film, `cells` deep, after fifteen times the time in which a film without yield stress develops."""
    layer = Layer(cells, _mud)
    depth = layer.depth
    developed = _DENSITY * ((1 - _PLUG) * depth) ** 2 / (_VISCOSITY * (math.pi / 2) ** 2)
    for _ in range(round(15 * developed / layer.rig.dt)):
        layer.advance(_SLOPE)
    rows, speed = layer.profile()
    return MudFlow(rows, speed, bingham_film(rows, depth))


_HELD = "the rough floor holds the lower half of the first cell, and the mud above is sheared over less depth"


@case(
    "mud-film",
    "Bingham 1922, Fluidity and plasticity; film on an incline",
    "4 and 8 cells deep, periodic",
    is_fast=False,
)
def mud_film(record: CaseRecorder) -> None:
    """A film of mud on a rough incline, the upper half of which is a plug: the speed of the plug, and its shear."""
    figure = record.plot("Film of mud on an incline", "height over depth [-]", "speed over that of the plug [-]")
    for cells, worst in ((4, 0.75), (8, 0.82)):
        found = film(cells)
        top, height = found.exact[-1], found.height / found.height[-1]
        plug = found.speed[height > 1.2 * (1 - _PLUG)]
        record.within(
            f"speed of the plug over Bingham's at {cells} cells",
            found.surface,
            0.9,
            1.1,
            shortfall=Shortfall(_HELD, worst),
        )
        record.at_most(f"shear of the plug at {cells} cells, over its speed", np.ptp(plug) / top, 0.03)
        figure.computed(f"MPM, {cells} cells", height, found.speed / top, points=True)
        figure.reference(f"Bingham, {cells} cells", height, found.exact / top)
