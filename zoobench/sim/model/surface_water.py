"""Water that acts on a robot's surface by forces: its constants, and the surface with its added mass."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import SceneError
from zoobench.sim.model.potential_flow import added_per_area, areas, potentials, slender_growth


@dataclass(frozen=True)
class Hull:
    """The surface of a body at rest, in triangles.

    Attributes:
        triangles: `[n, 3, 3]` corners [m], anticlockwise as seen from outside.
        edge: of the cubes that they were found with [m].
        unmoved: the same where it was found, whose added mass is that of this one; None for this one itself.
    """

    triangles: Array
    edge: float
    unmoved: "Hull | None" = field(default=None, repr=False)

    def moved(self, shift: Array) -> "Hull":
        """The same elsewhere, by `shift` `[3]` [m]."""
        return replace(self, triangles=self.triangles + shift, unmoved=self.unmoved or self)

    @cached_property
    def phi(self) -> Array:
        """Added mass per area and density of water `[n]` [m], which takes a second to find: see `added_per_area`."""
        if self.unmoved is not None:
            return self.unmoved.phi
        return added_per_area(self.triangles, potentials(self.triangles))

    @cached_property
    def growth(self) -> Array:
        """How the body widens ahead `[n]` [-], see `potential_flow.slender_growth`."""
        if self.unmoved is not None:
            return self.unmoved.growth
        return slender_growth(self.triangles, self.edge)

    @property
    def volume(self) -> float:
        """Volume within [m^3]."""
        return float((self.triangles.mean(1) * areas(self.triangles)).sum() / 3.0)


@dataclass(frozen=True)
class SurfaceWater:
    """Water without bounds, at rest or in a steady current, which has no memory of what swims in it.

    Attributes:
        density: [kg/m^3].
        normal_drag: coefficient of the pressure's drag on a plate across the flow [-].
        friction: coefficient of the drag along the surface [-].
        lift: factor C_l of the lift of a slender body (Jones 1946) [-]; 0 for none. A third of a sharp front
            edge is lost in panels and slices: 1.5 gives the square plate what is measured.
        current: velocity of the water [m/s].
        hull: surface of the robot at rest, at its start; None where there is no robot yet.
        constants: names of those that kernels have.
    """

    constants: ClassVar[tuple[str, ...]] = (
        "density", "normal_drag", "friction", "lift", "current_x", "current_y", "current_z",
    )  # fmt: skip

    density: float = 1000.0
    normal_drag: float = 1.1
    friction: float = 0.006
    lift: float = 1.5
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hull: Hull | None = field(default=None, repr=False)

    @property
    def current_x(self) -> float:
        """Of the current, ahead [m/s]."""
        return self.current[0]

    @property
    def current_y(self) -> float:
        """Of the current, up [m/s]."""
        return self.current[1]

    @property
    def current_z(self) -> float:
        """Of the current, to the right [m/s]."""
        return self.current[2]

    def check(self) -> None:
        """Refuse constants that no water has.

        Raises:
            SceneError: a density that is not positive, or a coefficient that is negative or not finite.
        """
        coefficients = {"drag": self.normal_drag, "friction": self.friction, "lift": self.lift}
        for name, value in coefficients.items():
            if not 0.0 <= value < math.inf:
                raise SceneError(f"A coefficient of {name} of {value:g} in water is not possible. Give 0 or more.")
        if not 0.0 < self.density < math.inf:
            raise SceneError(f"Water of {self.density:g} kg/m^3 is not possible. Give a positive density.")
        if not np.isfinite(self.current).all():
            raise SceneError(f"A current of {self.current} m/s is not finite. Give three numbers.")
