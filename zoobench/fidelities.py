"""The named fidelities: how finely a run is simulated. Numbers of different fidelities are never mixed."""

from typing import Literal

from zoobench.registry import Kind, register
from zoobench.sim.fidelity import Fidelity, Kernel, Transfer


@register(Kind.FIDELITY, "smoke")
def smoke(
    *,
    grid_spacing: float = 1 / 32,
    courant: float = 0.5,
    particles_per_cell: int = 8,
    precision: Literal[32, 64] = 32,
    step: float = 0.0,
    transfer: Transfer = "apic",
    kernel: Kernel = "quadratic",
) -> Fidelity:
    """Two cells across a robot: every moving part moves, no number means anything."""
    return Fidelity(grid_spacing, courant, particles_per_cell, precision, step, transfer, kernel)


@register(Kind.FIDELITY, "quick")
def quick(
    *,
    grid_spacing: float = 1 / 64,
    courant: float = 0.5,
    particles_per_cell: int = 8,
    precision: Literal[32, 64] = 32,
    step: float = 0.0,
    transfer: Transfer = "apic",
    kernel: Kernel = "quadratic",
) -> Fidelity:
    """Three cells across a robot: a first answer within minutes on a laptop."""
    return Fidelity(grid_spacing, courant, particles_per_cell, precision, step, transfer, kernel)


@register(Kind.FIDELITY, "paper")
def paper(
    *,
    grid_spacing: float = 1 / 128,
    courant: float = 0.5,
    particles_per_cell: int = 8,
    precision: Literal[32, 64] = 32,
    step: float = 0.0,
    transfer: Transfer = "apic",
    kernel: Kernel = "quadratic",
) -> Fidelity:
    """The grid of the published benchmark: six cells across a robot."""
    return Fidelity(grid_spacing, courant, particles_per_cell, precision, step, transfer, kernel)
