"""The named fidelities: resolutions of the simulation. Results of different fidelities are never mixed.

They differ in the grid spacing; the time step is proportional to it. For their errors and costs see docs/accuracy.md.
"""

from typing import Literal

from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity, Kernel, Transfer


def _name(name: str, spacing: float, summary: str) -> None:
    """Register a fidelity of this grid spacing [m]."""

    def fidelity(
        *,
        grid_spacing: float = spacing,
        courant: float = Fidelity.courant,
        particles_per_cell: int = Fidelity.particles_per_cell,
        precision: Literal[32, 64] = Fidelity.precision,
        step: float = Fidelity.step,
        transfer: Transfer = Fidelity.transfer,
        medium_transfer: Transfer = Fidelity.medium_transfer,
        kernel: Kernel = Fidelity.kernel,
        shift: float = Fidelity.shift,
        sleep: float = Fidelity.sleep,
    ) -> Fidelity:
        return Fidelity(
            grid_spacing, courant, particles_per_cell, precision, step, transfer, medium_transfer, kernel, shift, sleep
        )

    fidelity.__doc__ = summary
    register(Kind.FIDELITY, name, version=2, added=("sleep",))(fidelity)


_name("smoke", 1 / 32, "Two cells across a robot: for tests of the software; the results are meaningless.")
_name("draft", 1 / 64, "Three cells across a robot: for first results within minutes on a laptop.")
_name("standard", 1 / 96, "Five cells across a robot: for comparisons on a laptop.")
_name("paper", 1 / 128, "The grid of the published benchmark, not its particles and steps: six cells across a robot.")
_name("fine", 1 / 192, "Ten cells across a robot: to confirm a result.")
_name("reference", 1 / 256, "Thirteen cells across a robot: the reference for the others.")
