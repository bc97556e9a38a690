"""What every law is to the kernels; outside them it is a `sim.model.laws.medium.Medium`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import taichi as ti

Function = Callable[..., Any]


@dataclass(frozen=True)
class Yield:
    """A yield surface in Hencky strain, see `laws.hencky`.

    Attributes:
        largest_deviator: (volumetric strain, medium) -> norm of the deviatoric strain at yield.
        steepness: (medium) -> minus its derivative by the volumetric strain.
        spherical: (volumetric strain, medium) -> g and its derivative; the stress is 2 mu eps + g I.
        is_loose_in_tension: whether it bears no tension and remembers the volume gained while loose.
    """

    largest_deviator: Function
    steepness: Function
    spherical: Function
    is_loose_in_tension: bool = False


@dataclass(frozen=True)
class Law:
    """A constitutive law of a medium.

    `medium` holds its constants by name. A solid has `update` and its adjoint, a liquid `pressure`.

    Attributes:
        constants: their names, as the material has them.
        kappa: (history, medium) -> stiffness [Pa] of an isolated particle in its state, see `step_limits`.
        update: (trial b, history, medium, law) -> elastic b, new history, Kirchhoff stress [Pa].
        update_adjoint: (trial b, history, adjoints of these three, medium, law) -> adjoints of trial b and history.
        pressure: (J, medium) -> Kirchhoff pressure [Pa] and its derivative by J.
        is_viscous: whether it has the stress 2 eta dev(D), with the constant `viscosity`.
        slides: whether the ground holds it by no more than its shear strength, from the constant `yield_stress`; see
            `mud_wall`.
        surface: of a law in Hencky strain.
    """

    constants: tuple[str, ...]
    kappa: Function
    update: Function | None = None
    update_adjoint: Function | None = None
    pressure: Function | None = None
    is_viscous: bool = False
    slides: bool = False
    surface: Yield | None = None

    @property
    def is_liquid(self) -> bool:
        """Whether it is one; its particles have J in the place of b and the stress."""
        return self.pressure is not None


@ti.func
def linear_kappa(history, medium: ti.template()):
    """2 mu + 3 lambda, in Hencky strain [Pa]."""
    return 2.0 * medium.mu + 3.0 * medium.lam
