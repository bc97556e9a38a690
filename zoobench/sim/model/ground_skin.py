"""The skin of firm ground: a compliant layer of fixed thickness, by which the ground pushes on the robot.

Matter at a height y [m] above the ground has the energy per volume p(y) = K / (2 delta^2) (delta - y)^2 within the
thickness delta, and none above it: the ground pushes with the force per volume K / delta^2 (delta - y). A column of
matter that stands on the ground through the whole layer feels the pressure p(0) = K / 2. The law has no grid spacing,
so that a simulation has a limit on ever finer grids.

A particle stands for a cube of constant edge e: its force is the integral over the cube's height, which is continuously
differentiable by the particle's height. Friction is Coulomb's, with the force of the layer as the normal one (see
`kernels/skin_contact.py`).
"""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import SceneError
from zoobench.sim.model.terrain import Terrain


@dataclass(frozen=True)
class GroundSkin:
    """The compliant layer of firm ground.

    Attributes:
        thickness: delta [m].
        stiffness: K [Pa].
    """

    thickness: float = 4e-3
    stiffness: float = 2e4

    def __post_init__(self) -> None:
        if not 0.0 < self.thickness < np.inf or not 0.0 < self.stiffness < np.inf:
            raise SceneError(
                f"A skin of {self.thickness:g} m and {self.stiffness:g} Pa is not possible. Give positive numbers."
            )

    @property
    def rate(self) -> float:
        """K / delta^2, the gradient of the force per volume [N/m^4]."""
        return self.stiffness / self.thickness**2

    def pressure(self, height: Array) -> Array:
        """p [Pa] at heights above the ground [m]; also the energy per volume [J/m^3]."""
        return 0.5 * self.rate * np.square(np.maximum(self.thickness - height, 0.0))

    def force(self, height: Array, edge: float) -> Array:
        """Force per volume [N/m^3] on cubes of this edge [m] with their centres at these heights [m]."""
        return (self.pressure(height - edge / 2) - self.pressure(height + edge / 2)) / edge

    def energy(self, height: Array, edge: float) -> Array:
        """Energy per volume [J/m^3] of cubes of this edge [m] with their centres at these heights [m]."""

        def below(place: Array) -> Array:
            return self.rate / 6.0 * np.maximum(self.thickness - place, 0.0) ** 3

        return (below(height - edge / 2) - below(height + edge / 2)) / edge


SKIN = GroundSkin()


def heights_above(positions: Array, terrain: Terrain | None) -> tuple[Array, Array]:
    """Distance [m] `[n]` of points `[n, 3]` from the ground along its normal, and that normal `[n, 3]`.

    To first order in the curvature of a terrain.
    """
    if terrain is None:
        return positions[:, 1].copy(), np.tile([0.0, 1.0, 0.0], (len(positions), 1))
    normal = terrain.normals_below(positions)
    return (positions[:, 1] - terrain.heights_below(positions)) * normal[:, 1], normal
