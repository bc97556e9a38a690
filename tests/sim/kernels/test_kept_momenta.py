"""Momenta of the nodes that the forward pass keeps on the tape, so that the reverse need not compute them again."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.sim import scenes
from zoobench.sim.kernels.layout import KEPT
from zoobench.sim.model.fidelity import Kernel, Transfer
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.state import Matter, Parameters, empty_matter
from zoobench.sim.simulation import Simulation
from zoobench.sim.solver import Solver

WORLDS, STEPS = 2, 6


def _simulation(name: str, transfer: Transfer, kernel: Kernel, precision: int) -> Simulation:
    """Two worlds of a scene in motion, with muscles active."""
    fidelity = scenes.fidelity(precision, transfer=transfer, kernel=kernel)
    solver = Solver(scenes.SCENES[name](), fidelity, worlds=WORLDS)
    solver.run(scenes.actuation(solver, 2))
    return solver.simulation


def _pass(sim: Simulation, capacity: int | None) -> tuple[Matter, Matter, Parameters]:
    """The tape of some substeps, of another number in each world, and adjoints of state and parameters through it.

    `capacity` nodes of every world are kept on the way; None for all of them to be computed again.
    """
    real = sim.matter.x.dtype
    tape = empty_matter(sim.scene, STEPS + 1, WORLDS, real, "cpu")
    tape.load_slot(0, sim.matter)
    plan = LaunchPlan.none(WORLDS, real, "cpu")
    if capacity is not None:
        sim.launcher.keep(capacity)
        nodes = math.prod(sim.launcher.shape)
        tape.window[0, :, 6] = torch.tensor([nodes + world * sim.launcher._kept for world in range(WORLDS)])
    for first, counts in (([0, 0], [2, 3]), ([2, 3], [STEPS - 2, STEPS - 4])):
        plan.set(np.array(first), np.array(counts), np.full(WORLDS, sim.limit.dt))
        sim.launcher.advance(tape, sim.parameters, plan, 1)
    adjoint = empty_matter(sim.scene, 1, WORLDS, real, "cpu")
    rng = np.random.default_rng(5)
    for part in (adjoint.x, adjoint.v, adjoint.F):
        part[:] = torch.as_tensor(rng.normal(size=part.shape))
    parameters = Parameters.zeros(WORLDS, sim.robot_count, sim.particle_count, real, "cpu")
    for first, counts in (([2, 3], [STEPS - 2, STEPS - 4]), ([0, 0], [2, 3])):
        plan.set(np.array(first), np.array(counts), np.full(WORLDS, sim.limit.dt))
        sim.launcher.reverse(tape, sim.parameters, plan, adjoint, parameters)
    return tape, adjoint, parameters


def _results(found: tuple[Matter, Matter, Parameters]) -> list[Tensor]:
    tape, adjoint, parameters = found
    return [tape.state, tape.window[..., :6], adjoint.state, parameters.body]


CASES = [
    ("ground", "apic", "quadratic"),
    ("sand", "apic", "quadratic"),
    ("water", "apic", "quadratic"),
    ("ground", "aflip", "cubic"),
    ("water", "aflip", "quadratic"),
]


def _is_fast(name: str, transfer: Transfer, kernel: Kernel, precision: int) -> bool:
    return name == "ground" and transfer == "apic" and precision == 64


@pytest.mark.parametrize(
    ("name", "transfer", "kernel", "precision"),
    [
        # the others compile kernels that no other test needs
        pytest.param(*case, precision, marks=() if _is_fast(*case, precision) else pytest.mark.slow)
        for case in CASES
        for precision in (64, 32)
    ],
)
def test_kept_momenta_give_the_same_bits_as_those_computed_again(
    name: str, transfer: Transfer, kernel: Kernel, precision: int
) -> None:
    """States, adjoints of states and of parameters, with room for all substeps, for some and for none."""
    sim = _simulation(name, transfer, kernel, precision)
    expected = _pass(sim, None)
    assert not expected[0].window[..., KEPT].any()
    assert all(part.isfinite().all() and part.any() for part in _results(expected))
    window = sim.matter.window[0, 0, :6]
    substep = int((window[3:] - window[:3]).prod())
    for room, least, most in ((8 * substep // 10, 0, 0), (3 * substep, 1, 4), (3 * STEPS * substep, STEPS, STEPS)):
        sim.launcher._kept = 0
        found = _pass(sim, room)
        kept = found[0].window[:, 0, KEPT].sum()
        assert least <= kept <= most
        assert [torch.equal(a, b) for a, b in zip(_results(found), _results(expected), strict=True)] == [True] * 4
