"""Ocean: deep water with a neutrally buoyant swimmer, away from floor and surface."""

import math
from typing import Literal

from zoobench.envs.base import Environment, Stance, equilibration_frames
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import Objects
from zoobench.envs.physics import FRESH_WATER, SWIMMER, Physics, Water
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.envs.ranges import check_no_idle
from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.sim.model.surface_water import SurfaceWater

_DEPTH, _LENGTH, _WIDTH, _BULK_MODULUS = 0.15625, 0.4375, 0.1875, 1e5

_AFLOAT = Objects(object_mass=0.0)
"""None, and by default as dense as water."""

START = 0.4
"""Start of the robot, relative to the length."""

ONSET = 0.2
"""[s] In which muscles come to full activity in water by forces on the surface."""

_ROUGH = 0.5
"""Friction of a floor that is not level [-]. To the grid it is a staircase, down which water would stream for ever: at
draft 45 mm/s on a slope of 5 degrees, where friction leaves 0.8 mm/s."""

_FASTEST = 10.0
"""Largest current [m/s]: it presses on what stands still by a sixth of a swimmer's E. Of a fish, an orca and a panda at
draft and standard one diverges in it, the orca at standard; at 40 the fish does at every fidelity tried."""

_PROVISIONAL = (
    "of two gaits that turn at standard in water on a grid neither is known to be the better at paper: scores differ "
    "by 98 % (root mean square) from those there, and speeds by 39 %; swimmers go ahead by 0.1 lengths a beat at "
    "most, real ones by 0.5. Scores in water by forces on the surface (water=surface) are not provisional"
)


@register(
    Kind.ENV, "ocean", version=15, tags=("water", "fluid"),
    added=("fluid", "hills", "profile", "physics", "current", "objects"), was={"water": "grid"},
    provisional=_PROVISIONAL, unless={"water": "surface"},
)  # fmt: skip
def ocean(
    *,
    depth: float = _DEPTH,
    length: float = _LENGTH,
    width: float = _WIDTH,
    bulk_modulus: float = _BULK_MODULUS,
    water: Literal["surface", "grid", "particles"] = "surface",
    fluid: Water = FRESH_WATER,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = SWIMMER,
    current: float = 0.0,
    onset: float = ONSET,
    objects: Objects = _AFLOAT,
) -> Environment:
    """Deep water, in which a robot as dense as water floats.

    Water by forces on the surface (`surface`) has no bounds, no wake and no memory: each part of the robot's surface
    feels drag, lift and the inertia of the water that it moves (Lighthill 1960), which are the same on every grid. The
    robot is in its rest frame then. Fish swim in it by 0.3 to 0.8 lengths a beat.

    The others are three times as deep as a robot is tall. Water on a grid is incompressible, flows with hardly any
    viscosity and fills a closed box with smooth walls, which goes with the robot where there are no objects: it has
    neither surface nor weight, and a body feels gravity by as much as it is denser than water. In a box of twice the
    length and width a strong fish's speed differs by 6 to 22 %. Water of particles is that of the published benchmark:
    weakly compressible, with a surface, and as thick as syrup. Of a coasting fish's speed 70 % are left after 10 ms in
    the former and 5 % in the latter, 80 to 90 % in real water.

    A level floor has no friction; hills, slopes, steps and gaps are rough, so that water rests on them; water on a grid
    has none.

    * `depth`: of the water above the lowest ground [m].
    * `length`, `width`: of water and arena along x and z, on a grid at least [m].
    * `bulk_modulus`: K of water of particles [Pa]. At 1e5 the water is compressed by 1.5 % at the bottom, and the speed
      of sound is 10 m/s.
    * `water`: `surface`, `grid` or `particles` [-].
    * `current`: steady velocity of water by forces on the surface, ahead [m/s]; at most 10 either way.
    * `onset`: time in which muscles come to full activity in water by forces on the surface [s]; 0 for at once. A full
      stroke from rest turns a swimmer, and on another grid by another angle, which it keeps.

    Water on a grid has no `tait_exponent`. Water by forces has neither that nor a `viscosity`, a `depth`, a `length`, a
    `width` and a `bulk_modulus`: other values than the default ones are refused there.
    """
    if water == "surface":
        _check_no_idle(
            depth=(depth, _DEPTH),
            length=(length, _LENGTH),
            width=(width, _WIDTH),
            bulk_modulus=(bulk_modulus, _BULK_MODULUS),
            tait_exponent=(fluid.tait_exponent, FRESH_WATER.tait_exponent),
            viscosity=(fluid.viscosity, FRESH_WATER.viscosity),
        )
    check_no_idle(objects, _AFLOAT, "object=box")
    if objects and water != "grid":
        raise UsageError(f"An object is possible in water on a grid, not with water={water}. Give water=grid.")
    is_level = profile.is_level and not hills.relief
    gravity = (0.0, -physics.gravity, 0.0)
    if abs(current) > _FASTEST:
        raise UsageError(
            f"A current of {current:g} m/s would crush a robot, which is soft. Give {_FASTEST:g} m/s at most, "
            "either way."
        )
    if current and water != "surface":
        raise UsageError(
            f"A current of {current:g} m/s flows in water=surface alone. Leave out the current, or water={water}."
        )
    if not 0.0 <= onset < math.inf:
        raise UsageError(f"An onset of {onset:g} s is not possible. Give 0 or more.")
    if onset != ONSET and water != "surface":
        raise UsageError(
            f"An onset of {onset:g} s is one of water=surface alone. Leave out the onset, or water={water}."
        )
    if not is_level and water != "particles":
        raise UsageError(
            "Water by forces on the surface has no floor, and water on a grid a level one. Leave out hills, slopes, "
            "steps and gaps, or use water=particles."
        )
    if water != "particles":
        forces = SurfaceWater(density=fluid.medium_density, current=(current, 0.0, 0.0))
        return Environment(
            robot=physics.robot,
            friction=0.0,
            arena=(length, depth, width),
            start=(START, 0.5),
            stance=Stance.SWIMMING,
            gravity=gravity,
            water=fluid.on_grid if water == "grid" else None,
            surface_water=forces if water == "surface" else None,
            onset=onset if water == "surface" else 0.0,
            objects=objects,
        )
    return Environment(
        robot=physics.robot,
        friction=0.0 if is_level else _ROUGH,
        arena=(length, depth + 0.1, width),
        bed=Bed(fluid.material(bulk_modulus), depth),
        start=(START, 0.5),
        stance=Stance.SWIMMING,
        equilibration_frames=equilibration_frames(physics.gravity),
        gravity=gravity,
        hills=hills,
        profile=profile,
    )


def _check_no_idle(**settings: tuple[float, float]) -> None:
    """Refuse settings without effect in water by forces on the surface, each with its default: they make new runs."""
    for name, (value, default) in settings.items():
        if value != default:
            raise UsageError(
                f"{name}={value:g} has no effect with water=surface, which is without bounds and incompressible, and "
                "whose friction is a coefficient. Leave it out, or choose water=grid or water=particles."
            )
