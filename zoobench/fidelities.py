"""The named fidelities: how finely a run is simulated. Numbers of different fidelities are never mixed.

They differ in the grid; a finer one has proportionally shorter steps. docs/accuracy.md says how far each is from a
converged simulation, and what it costs.
"""

from typing import Literal

from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity, Kernel, Transfer


def _name(name: str, spacing: float, summary: str) -> None:
    """Register a fidelity of this grid spacing [m], every other knob at its default."""

    def fidelity(
        *,
        grid_spacing: float = spacing,
        courant: float = 0.5,
        particles_per_cell: int = 8,
        precision: Literal[32, 64] = 32,
        step: float = 0.0,
        transfer: Transfer = "apic",
        kernel: Kernel = "quadratic",
        shift: float = 0.0,
    ) -> Fidelity:
        return Fidelity(grid_spacing, courant, particles_per_cell, precision, step, transfer, kernel, shift)

    fidelity.__doc__ = summary
    register(Kind.FIDELITY, name)(fidelity)


_name("smoke", 1 / 32, "Two cells across a robot: every moving part moves, no number means anything.")
_name("draft", 1 / 64, "Three cells across a robot: a first answer within minutes on a laptop.")
_name("standard", 1 / 96, "Five cells across a robot: for comparisons on a laptop.")
_name("paper", 1 / 128, "The grid of the published benchmark: six cells across a robot.")
_name("fine", 1 / 192, "Ten cells across a robot: to see whether a result stands.")
_name("reference", 1 / 256, "Thirteen cells across a robot: what the others are judged by.")
