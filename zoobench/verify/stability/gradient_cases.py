"""Gradients where they are fragile: at equal principal stretches, and with all muscles at full strength."""

import numpy as np
from numpy.typing import NDArray

from zoobench import registry
from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.sim.model.laws_numpy import principal_stress, radial_return, snow_return
from zoobench.sim.model.matter import ClayMaterial, Medium, MudMaterial, SnowMaterial, WaterMaterial
from zoobench.sim.model.scene import Scene
from zoobench.spec import Ref
from zoobench.verify.energies import to_array
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import episode, healthy

Extended = NDArray[np.longdouble]

_GAPS = (1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 0.0)
_PACKED = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _stresses(material: Medium, squares: Extended) -> Extended:
    """Principal stresses [Pa] `[..., 3]` after the return, of principal values of the trial b `[..., 3]`."""
    strain = 0.5 * np.log(squares)
    flat = np.zeros(squares.shape[:-1], dtype=np.longdouble)
    if isinstance(material, SnowMaterial):
        elastic, plastic = snow_return(material, strain, flat + 1.0)  # type: ignore[arg-type]
        return principal_stress(material, elastic, plastic)  # type: ignore[return-value]
    assert not isinstance(material, WaterMaterial)
    elastic, _, _ = radial_return(material, strain, flat)  # type: ignore[arg-type]
    return principal_stress(material, elastic)  # type: ignore[return-value]


def exact_pull(material: Medium, squares: Extended, pull: Array) -> Array:
    """Derivative of pull : tau by the trial b, both `[3, 3]` in the frame of b, whose principal values are given.

    tau is an isotropic function of b: on the diagonal its Jacobian by the principal values counts, off it the divided
    differences, or their limit where the values meet (Carlson and Hoger 1986). Extended precision makes both exact to
    1e-12 here.
    """
    width = np.longdouble(1e-7)
    near, far = (
        _stresses(material, squares + n * width * np.eye(3)) - _stresses(material, squares - n * width * np.eye(3))
        for n in (1, 2)
    )
    jacobian = (8 * near - far) / (12 * width)  # [by, of]
    here = _stresses(material, squares)
    result = np.diag((jacobian @ np.diag(pull).astype(np.longdouble)).astype(np.float64))
    for i in range(3):
        for j in range(3):
            if i != j:
                gap = squares[i] - squares[j]
                close = abs(gap) < 1e-9
                slope = jacobian[i, i] - jacobian[i, j] if close else (here[i] - here[j]) / gap
                result[i, j] = float(slope) * pull[i, j]
    return result


def solver_pull(name: str, frames: Array, squares: Array, pulls: Array, precision: int) -> Array:
    """The same from the solver's own reverse of one substep, of particles at rest without stress: `[count, 3, 3]`."""
    from zoobench.sim.model.state import Parameters, empty_matter
    from zoobench.sim.solver import Solver

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
    adjoint.tau[0, 0] = solver.simulation.tensor(_pack(np.einsum("nij,njk,nlk->nil", frames, pulls, frames)))
    parameters = Parameters.zeros(1, 1, solver.particle_count, real, device)
    solver.launcher.reverse(tape, solver.parameters, solver.simulation.plan(first, counts), adjoint, parameters)
    packed = to_array(adjoint.b[0, 0])
    found = packed[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
    turned: Array = np.einsum("nji,njk,nkl->nil", frames, found, frames)
    return turned


def _pack(matrices: Array) -> Array:
    packed: Array = np.stack([matrices[:, i, j] for i, j in _PACKED], axis=1)
    return packed


@case("equal-stretches", fast=False)
def equal_stretches(probe: Probe) -> None:
    """Adjoints of sand, clay, mud and snow where principal stretches differ by 0.1 down to nothing.

    In 32 bits b itself is rounded, which turns a deviator at the yield strain y / (2 mu) by half an epsilon over that.
    """
    rng = np.random.default_rng(10)
    count = len(_GAPS) * 4
    gaps = np.repeat(_GAPS, 4)
    stretch = 0.99 * np.stack([1.0 + gaps, np.ones(count), 1.0 - gaps], axis=1)
    frames = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    pulls = rng.normal(size=(count, 3, 3))
    pulls = 0.5 * (pulls + np.swapaxes(pulls, 1, 2))
    for name in ("sand", "clay", "mud", "snow"):
        material = scenes.medium_material(name)
        squares = np.square(stretch)
        exact = np.array(
            [exact_pull(material, s.astype(np.longdouble), p) for s, p in zip(squares, pulls, strict=True)]
        )
        size = np.linalg.norm(exact, axis=(1, 2))
        rounding = 1e-5
        if isinstance(material, ClayMaterial | MudMaterial):
            mu, _, yield_stress, *_ = material.constants
            rounding = max(rounding, 0.5 * float(np.finfo(np.float32).eps) * 2.0 * mu / yield_stress)
        for precision, tolerance in ((64, 1e-10), (32, rounding)):
            found = solver_pull(name, frames, squares, pulls, precision)
            error = np.linalg.norm(found - exact, axis=(1, 2)) / size
            probe.below(f"{name}, {precision} bits: relative error", float(error.max()), tolerance)


@case("full-strength")
def full_strength(probe: Probe) -> None:
    """The caterpillar with all muscles at full strength in turn, its gradient included."""
    from zoobench.sim.solver import Solver

    grid = scenes.fidelity()
    body = registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid)
    scene = registry.create(Kind.ENV, Ref("ground")).scene(body, grid)
    solver = Solver(scene, grid, gradients=True)
    signs = np.where((np.arange(100)[:, None] // 8 + np.arange(solver.muscle_count)) % 2 == 0, 1.0, -1.0)
    rollout, ledger = episode(probe, solver, signs[:, None, :])
    healthy(probe, rollout)
    probe.above("smallest J", float(rollout.smallest_j.min()), 0.05)
    probe.above("lowest [cells]", ledger.smallest(lambda entry: entry.lowest[1]) / scenes.SPACING, -1.0)
    pull = np.ones(rollout.positions.shape) / rollout.positions.size
    gradient = solver.backward(rollout, pull, np.zeros_like(pull))
    norm = float(np.linalg.norm(gradient.actuation))
    probe.holds(f"gradient finite ({norm:.3g})", bool(np.isfinite(norm)) and norm > 0.0 and not gradient.fault)
