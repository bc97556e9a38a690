"""Gradients at equal principal stretches, and with all muscles at full strength."""

import itertools

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.state import Parameters, empty_matter
from zoobench.sim.solver import Solver
from zoobench_verify.energies import to_array, unpacked
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case

Extended = NDArray[np.longdouble]

_GAPS = (1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 0.0)
_PACKED = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _stresses(material: Medium, squares: Extended) -> Extended:
    """Principal stresses [Pa] `[..., 3]` after the return, of principal values of the trial b `[..., 3]`."""
    strain = 0.5 * np.log(squares)
    history = material.rest_history(strain).astype(np.longdouble)
    return material.stress(*material.returned(strain, history))  # type: ignore[arg-type,return-value]


def exact_adjoint(material: Medium, squares: Extended, adjoint: Array) -> Array:
    """Derivative of adjoint : tau by the trial b, both `[3, 3]` in the frame of b, whose principal values are given.

    tau is an isotropic function of b: its derivative has the Jacobian of the principal values on the diagonal and
    divided differences off it, or their limit where the values are equal (Carlson and Hoger 1986). Extended precision
    makes both exact to 1e-12 here.
    """
    width = np.longdouble(1e-7)
    near, far = (
        _stresses(material, squares + n * width * np.eye(3)) - _stresses(material, squares - n * width * np.eye(3))
        for n in (1, 2)
    )
    jacobian = (8 * near - far) / (12 * width)  # [by, of]
    here = _stresses(material, squares)
    result = np.diag((jacobian @ np.diag(adjoint).astype(np.longdouble)).astype(np.float64))
    for i, j in itertools.permutations(range(3), 2):
        gap = squares[i] - squares[j]
        quotient = jacobian[i, i] - jacobian[i, j] if abs(gap) < 1e-9 else (here[i] - here[j]) / gap
        result[i, j] = float(quotient) * adjoint[i, j]
    return result


def solver_adjoint(name: str, frames: Array, squares: Array, adjoints: Array, precision: int) -> Array:
    """The same from the solver's reverse of one substep, for particles at rest without stress: `[count, 3, 3]`."""
    count = len(squares)
    sites = np.indices((3, 3, 3)).reshape(3, -1).T[:count].astype(np.float64)
    places: Array = scenes.SPACING * (4.3 + 4.0 * sites)
    bed = scenes.bed_of(scenes.medium_material(name), places)
    scene = Scene(scenes.bystander((0.05, 0.05, 0.05)), scenes.ORIGIN, (0.75,) * 3, medium=bed, gravity=scenes.STILL)
    solver = Solver(scene, scenes.fidelity(precision), gradients=True)
    solver.reset()
    b = np.einsum("nij,nj,nkj->nik", frames, squares, frames)
    device, real = str(solver.matter.x.device), solver.matter.x.dtype
    tape = empty_matter(scene, 2, 1, real, device)
    tape.load_slot(0, solver.matter.copy_slot(0))
    tape.b[0, 0] = solver.simulation.tensor(_pack(b))
    first, counts = np.zeros(1, np.int64), np.ones(1, np.int64)
    solver.simulation.advance(tape, first, counts, stride=1)
    adjoint = empty_matter(scene, 1, 1, real, device)
    adjoint.tau[0, 0] = solver.simulation.tensor(_pack(np.einsum("nij,njk,nlk->nil", frames, adjoints, frames)))
    parameters = Parameters.zeros(1, 1, solver.particle_count, real, device)
    solver.launcher.reverse(tape, solver.parameters, solver.simulation.plan(first, counts), adjoint, parameters)
    found = unpacked(to_array(adjoint.b[0, 0]))
    turned: Array = np.einsum("nji,njk,nkl->nil", frames, found, frames)
    return turned


def _pack(matrices: Array) -> Array:
    """The inverse of `unpacked`."""
    return np.stack([matrices[:, i, j] for i, j in _PACKED], axis=1)


@case("equal-stretches", is_fast=False)
def equal_stretches(record: EpisodeRecorder) -> None:
    """Adjoints of sand, clay, mud and snow where principal stretches differ by 0.1 down to nothing.

    In 32 bits b itself is rounded, which rotates a deviator at the yield strain y / (2 mu) by half an epsilon over it.
    """
    rng = np.random.default_rng(10)
    count = len(_GAPS) * 4
    gaps = np.repeat(_GAPS, 4)
    stretch = 0.99 * np.stack([1.0 + gaps, np.ones(count), 1.0 - gaps], axis=1)
    frames = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    adjoints = rng.normal(size=(count, 3, 3))
    adjoints = 0.5 * (adjoints + np.swapaxes(adjoints, 1, 2))
    for name in ("sand", "clay", "mud", "snow"):
        material = scenes.medium_material(name)
        squares = np.square(stretch)
        exact = np.array(
            [exact_adjoint(material, s.astype(np.longdouble), a) for s, a in zip(squares, adjoints, strict=True)]
        )
        size = np.linalg.norm(exact, axis=(1, 2))
        rounding = 1e-5
        if isinstance(material, ClayMaterial | MudMaterial):
            mu, yield_stress = material.mu, material.yield_stress
            rounding = max(rounding, 0.5 * float(np.finfo(np.float32).eps) * 2.0 * mu / yield_stress)
        for precision, tolerance in ((64, 1e-10), (32, rounding)):
            found = solver_adjoint(name, frames, squares, adjoints, precision)
            error = np.linalg.norm(found - exact, axis=(1, 2)) / size
            record.at_most(f"{name}, {precision} bits: relative error", error.max(), tolerance)


@case("full-strength")
def full_strength(record: EpisodeRecorder) -> None:
    """The caterpillar with all muscles at full strength in turn, its gradient included."""
    grid = scenes.fidelity()
    solver = Solver(scenes.caterpillar_scene(grid), grid, gradients=True)
    signs = np.where((np.arange(100)[:, None] // 8 + np.arange(solver.muscle_count)) % 2 == 0, 1.0, -1.0)
    rollout, energies = record.episode(solver, signs[:, None, :])
    record.robot_volume(rollout, 0.05)
    record.stays_above(energies, scenes.SPACING)
    record.moves(energies)
    adjoint = np.ones(rollout.positions.shape) / rollout.positions.size
    gradient = solver.backward(rollout, adjoint, np.zeros_like(adjoint))
    record.gradient_finite(gradient, [gradient.actuation])
