"""Muscles at and beyond their limits: steps, flutter, run-away extension, and a body that folds onto itself."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.sim.model.matter import lame_parameters
from zoobench.sim.model.scene import ElasticBody
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import episode, healthy

_MU, _LAM = lame_parameters(scenes.MUSCLE.youngs_modulus, scenes.MUSCLE.poissons_ratio)
_MIDDLE = (0.3125, 0.3125, 0.3125)


def _across(stretch: float) -> float:
    """Stretch across a fibre that is stretched along and free across: mu (c^2 - 1) + lambda log(J) = 0."""
    from scipy.optimize import brentq

    return float(brentq(lambda c: _MU * (c**2 - 1) + _LAM * np.log(stretch * c**2), 1e-3, 1e3, xtol=1e-14))


def _energy(stretch: float, tension: float) -> float:
    """Least energy density [J/m^3] of a fibre at this stretch under an active stress [Pa]: free across."""
    c = _across(stretch)
    log_j = np.log(stretch * c**2)
    strain = 0.5 * _MU * (stretch**2 + 2 * c**2 - 3) - _MU * log_j + 0.5 * _LAM * log_j**2
    return float(strain + 0.5 * tension * stretch**2)


def stretches_at_rest(tension: float) -> tuple[float, float]:
    """Stretches along and across a free neo-Hookean fibre at rest under an active stress [Pa] above -mu.

    Free of stress along it means mu (a^2 - 1) + lambda log(J) + tension a^2 = 0.
    """
    from scipy.optimize import brentq

    def stress(a: float) -> float:
        return float(_MU * (a**2 - 1) + _LAM * np.log(a * _across(a) ** 2) + tension * a**2)

    along = float(brentq(stress, 0.1, 10.0, xtol=1e-14))
    return along, _across(along)


def equilibrium(tension: float) -> float:
    """Stretch along the fibre at rest."""
    return stretches_at_rest(tension)[0]


def turning_point(tension: float) -> float:
    """Stretch at which a fibre turns back that was let go at rest: it has no more energy than there."""
    from scipy.optimize import brentq

    still = equilibrium(tension)
    beyond = (still, 30.0) if tension < 0.0 else (1e-2, still)

    def surplus(stretch: float) -> float:
        return _energy(stretch, tension) - _energy(1.0, tension)

    return float(brentq(surplus, *beyond))


def cube(strength: float, per_cell: int = scenes.PER_CELL) -> ElasticBody:
    """One muscle along x through a whole block, as strong as told [Pa]."""
    positions = scenes.lattice(_MIDDLE, (4, 4, 4), per_cell) + 1.0
    body = scenes.passive(positions, replace(scenes.MUSCLE, muscle_strength=strength), per_cell=per_cell)
    return replace(body, muscle_membership=np.ones((body.particle_count, 1)))


def _stretches(positions: NDArray[np.floating], rest: Array) -> Array:
    """Stretch along x of a body in every frame: the slope of its places by those at rest."""
    centred = rest[:, 0] - rest[:, 0].mean()
    slopes: Array = positions[:, 0, :, 0] @ centred / (centred @ centred)
    return slopes


def _drive(
    probe: Probe, body: ElasticBody, actuation: Array, name: str, *, frame_seconds: float = 0.008, per_cell: int = 8
) -> Array:
    """Stretch along x of a driven cube, with the checks that hold for all of them."""
    from zoobench.sim.solver import Solver

    fidelity = replace(scenes.fidelity(64), particles_per_cell=per_cell)
    solver = Solver(scenes.flight(body, 3.0), fidelity, frame_seconds=frame_seconds)
    rollout, ledger = episode(probe, solver, actuation[:, None, None])
    healthy(probe, rollout)
    probe.above(f"{name}: smallest J", float(rollout.smallest_j.min()), 0.05)
    mass = float(solver.parameters.mass.sum())
    speed = ledger.largest(lambda entry: float(np.linalg.norm(entry.momentum))) / mass
    probe.below(f"{name}: speed of the centre / largest speed", speed / ledger.largest(lambda e: e.speed), 1e-9)
    return _stretches(rollout.positions, body.positions)


@case("muscle-step")
def muscle_step(probe: Probe) -> None:
    """Full contraction at once, and a push at once of half the stress at which a fibre loses its equilibrium.

    The fibre overshoots, but not beyond the stretch at which it has as much energy as at rest.
    """
    pulled = _drive(probe, cube(3e3), np.ones(60), "pull")
    probe.above("pull: smallest stretch / turning point", float(pulled.min()) / turning_point(3e3), 1.0)
    pushed = _drive(probe, cube(0.5 * _MU), -np.ones(60), "push")
    probe.below("push: largest stretch / turning point", float(pushed.max()) / turning_point(-0.5 * _MU), 1.0)
    for name, stretch, tension in (("pull", pulled, 3e3), ("push", pushed, -0.5 * _MU)):
        still = equilibrium(tension)
        away = abs(float(stretch[-20:].mean()) - still) / abs(1.0 - still)
        probe.below(f"{name}: distance from equilibrium at the end / at first", away, 0.3)


@case("muscle-near-runaway")
def muscle_near_runaway(probe: Probe) -> None:
    """A push that grows within half a second to 0.8 of the stress without equilibrium; the fibre doubles its length.

    Beyond twice its length a body of two particles per cell and axis comes apart, so here it has three. At once, the
    same push would carry the fibre beyond three times its length.
    """
    ramp = -np.minimum(np.arange(1, 121) / 60.0, 1.0)
    stretch = _drive(probe, cube(0.8 * _MU, 27), ramp, "push", per_cell=27)
    still = equilibrium(-0.8 * _MU)
    probe.below("largest stretch / equilibrium", float(stretch.max()) / still, 1.3)
    away = abs(float(stretch[-30:].mean()) - still) / abs(1.0 - still)
    probe.below("distance from equilibrium at the end / at first", away, 0.3)
    probe.remark(f"at once, the turning point is {turning_point(-0.8 * _MU):.2g}")


@case("muscle-flutter")
def muscle_flutter(probe: Probe) -> None:
    """Full contraction and full push in turn, 200 times a second."""
    signs = np.where(np.arange(400) % 2 == 0, 1.0, -1.0)
    stretch = _drive(probe, cube(3e3), signs, "flutter", frame_seconds=0.0025)
    probe.below("largest stretch / that of a steady push", float(stretch.max()) / equilibrium(-3e3), 2.0)
    probe.above("smallest stretch / that of a steady pull", float(stretch.min()) / equilibrium(3e3), 0.5)


@case("control-muscle-runaway")
def muscle_runaway(probe: Probe) -> None:
    """Negative control: a push beyond mu has no equilibrium; such a muscle is refused or named as diverged."""
    from zoobench.errors import SceneError
    from zoobench.sim.solver import Solver

    try:
        body = cube(1.2 * _MU)
        solver = Solver(scenes.flight(body, 3.0), scenes.fidelity())
        rollout, _ = episode(probe, solver, -np.ones((250, 1, 1)))
    except SceneError as error:
        probe.holds(f"refused ({error!s:.60})", "strength" in str(error))
        return
    probe.holds("flagged", bool(rollout.divergences))
    probe.holds("path finite", bool(np.isfinite(rollout.positions).all()))


def _horseshoe() -> ElasticBody:
    """Two arms of eight cells that a back of two joins, each with a muscle along its inner side."""
    h = scenes.SPACING
    x, y, z = _MIDDLE
    parts = [
        scenes.lattice((x, y, z), (2, 7, 2)),
        scenes.lattice((x + 2 * h, y, z), (8, 2, 2)),
        scenes.lattice((x + 2 * h, y + 5 * h, z), (8, 2, 2)),
    ]
    body = scenes.passive(np.concatenate(parts), scenes.MUSCLE)
    height = body.positions[:, 1] - y
    arm = body.positions[:, 0] - x > 2 * h
    inner = arm & (height > h) & (height < 6 * h)
    return replace(body, muscle_membership=inner[:, None].astype(float))


@case("fold")
def fold(probe: Probe) -> None:
    """A horseshoe closes with all its strength until its arms press on each other: nothing inverts or drifts."""
    from zoobench.sim.solver import Solver

    body = _horseshoe()
    solver = Solver(scenes.flight(body, 1.0), scenes.fidelity(64), gradients=True)
    rollout, ledger = episode(probe, solver, np.ones((75, 1, 1)))
    healthy(probe, rollout)
    tips = body.positions[:, 0] > body.positions[:, 0].max() - scenes.SPACING
    upper = tips & (body.positions[:, 1] > body.positions[:, 1].mean())
    lower = tips & ~upper
    gap = rollout.positions[:, 0, upper, 1].min(1) - rollout.positions[:, 0, lower, 1].max(1)
    probe.below("smallest gap between the tips [cells]", float(gap.min()) / scenes.SPACING, 1.5)
    probe.above("smallest gap between the tips [cells]", float(gap.min()) / scenes.SPACING, -1.0)
    probe.above("smallest J", float(rollout.smallest_j.min()), 0.05)
    mass = float(solver.parameters.mass.sum())
    speed = ledger.largest(lambda entry: float(np.linalg.norm(entry.momentum))) / mass
    probe.below("speed of the centre / largest speed", speed / ledger.largest(lambda e: e.speed), 1e-9)
    pull = np.zeros(rollout.positions.shape)
    pull[-1, 0, upper, 1] = 1.0
    gradient = solver.backward(rollout, pull, np.zeros_like(pull))
    norm = float(np.linalg.norm(gradient.actuation))
    probe.holds(f"gradient finite ({norm:.3g})", bool(np.isfinite(norm)) and norm > 0.0 and not gradient.fault)
