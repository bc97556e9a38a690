"""The interface of every medium's law outside the kernels; a law is a file here and one in `kernels.laws`."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.elastic import Solid


class Medium(ABC):
    """The matter of a bed, or water: the constants of its law as fields, with the law's NumPy twin.

    Strains are principal elastic Hencky strains `[..., 3]`; the law defines the history of a particle `[...]`.

    Attributes:
        name: of the matter.
        kernels: the module that holds the law for kernels, as `LAW`.
        constants: names of the attributes that kernels have as constants, under the same names.
        colour: red, green and blue in [0, 1], in which it is drawn.
        yields: whether it is plastic.
        flows: whether it is viscous or has the pressure of a fluid.
        is_liquid: whether a particle has a volume ratio J and no strain of its own.
        locks: whether it yields at constant volume, against which the particles of a cell would lock (`kernels.fbar`).
        limits: exclusive upper bounds of fields.
        density: rho [kg/m^3].
        viscosity: eta [Pa s] of one that flows.
    """

    name: ClassVar[str]
    kernels: ClassVar[str]
    constants: ClassVar[tuple[str, ...]]
    colour: ClassVar[tuple[float, float, float]]
    yields: ClassVar[bool] = False
    flows: ClassVar[bool] = False
    is_liquid: ClassVar[bool] = False
    locks: ClassVar[bool] = False
    limits: ClassVar[Mapping[str, float]] = {}
    __dataclass_fields__: ClassVar[dict[str, Any]]  # every one is a dataclass
    density: float
    viscosity: float

    @property
    @abstractmethod
    def kappa(self) -> float:
        """Stiffness of the isolated particle [Pa] in the stiffest intended state, see `step_limits`."""

    @abstractmethod
    def rest_strains(self, load: Array) -> Array:
        """Strains `[n, 3]` (x, y, z) of a confined column at rest under a vertical load `[n]` [Pa].

        The closed form for small strains: under the loads of a bed of centimetres they are some tenths of a percent.
        """

    @abstractmethod
    def rest_history(self, strain: Array) -> Array:
        """The history `[...]` of matter that has never yielded."""

    @abstractmethod
    def returned(self, strain: Array, history: Array) -> tuple[Array, Array]:
        """Elastic strain and new history from a trial strain and the old history: the plastic return."""

    @abstractmethod
    def stress(self, strain: Array, history: Array | float = 1.0) -> Array:
        """Principal Kirchhoff stresses `[..., 3]` [Pa] of matter that does not move."""

    @abstractmethod
    def energy(self, strain: Array, history: Array | float = 1.0) -> Array:
        """Energy density [J/m^3] `[...]`, whose derivative by the strain is `stress`."""


@dataclass(frozen=True)
class SolidMedium(Solid, Medium):
    """A medium whose particles have a strain."""

    @property
    @abstractmethod
    def largest_shear(self) -> float:
        """The shear strain of `rest_strains` at which a column yields [-]."""

    def rest_strains(self, load: Array) -> Array:
        """A solid carries the load by eps_yy = -load / (lambda + 2 mu), sheared no further than it can."""
        mu, lam = self.lame
        deviator = np.array([1.0, -2.0, 1.0]) / 3.0  # of a unit strain -1 along y
        shear = np.minimum(load / (lam + 2.0 * mu), self.largest_shear)
        mean = (load - 2.0 * mu * 2.0 / 3.0 * shear) / (lam + 2.0 / 3.0 * mu)
        return -mean[:, None] / 3.0 + shear[:, None] * deviator
