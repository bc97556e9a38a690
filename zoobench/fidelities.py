"""The named fidelities: resolutions of the simulation. Results of different fidelities are never mixed.

They differ in the grid spacing; the time step is proportional to it. For their errors and costs see docs/accuracy.md.
"""

from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity


def _name(name: str, spacing: float, summary: str) -> None:
    """Register a fidelity of this grid spacing [m], whose settings are the parameters."""
    default = Fidelity(spacing)

    def fidelity(*, settings: Fidelity = default) -> Fidelity:
        return settings

    fidelity.__doc__ = summary
    register(Kind.FIDELITY, name, version=2, added=("sleep", "device", "robot"))(fidelity)


_name("smoke", 1 / 32, "Two cells across a robot: for tests of the software; the results are meaningless.")
_name("draft", 1 / 64, "Three cells across a robot: for first results within minutes on a laptop.")
_name("standard", 1 / 96, "Five cells across a robot: for comparisons on a laptop.")
_name("paper", 1 / 128, "The grid of the published benchmark, not its particles and steps: six cells across a robot.")
_name("fine", 1 / 192, "Ten cells across a robot: to confirm a result.")
_name("reference", 1 / 256, "Thirteen cells across a robot: the reference for the others.")
