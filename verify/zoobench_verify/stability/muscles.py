"""Muscles at and beyond their limits: steps, flutter, unbounded extension, and a body that folds onto itself."""

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from zoobench.arrays import Array
from zoobench.errors import SceneError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.solver import Solver
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case

_MU, _LAM = scenes.MUSCLE.lame


def _across(stretch: float) -> float:
    """Stretch across a fibre of this stretch along that is free across: mu (c^2 - 1) + lambda log(J) = 0."""
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

    def stress(a: float) -> float:
        return float(_MU * (a**2 - 1) + _LAM * np.log(a * _across(a) ** 2) + tension * a**2)

    along = float(brentq(stress, 0.1, 10.0, xtol=1e-14))
    return along, _across(along)


def turning_point(tension: float) -> float:
    """The other stretch at which a fibre released from rest at stretch 1 has no kinetic energy."""
    still = stretches_at_rest(tension)[0]
    beyond = (still, 30.0) if tension < 0.0 else (1e-2, still)

    def surplus(stretch: float) -> float:
        return _energy(stretch, tension) - _energy(1.0, tension)

    return float(brentq(surplus, *beyond))


def muscle_cube(strength: float, per_cell: int = scenes.PER_CELL) -> ElasticBody:
    """A cube with one muscle of a strength [Pa] along x through all of it."""
    material = replace(scenes.MUSCLE, muscle_strength=strength)
    body = scenes.passive(scenes.cube(per_cell=per_cell) + 1.0, material, per_cell=per_cell)
    return replace(body, muscle_membership=np.ones((body.particle_count, 1)))


def _drive(
    record: EpisodeRecorder,
    body: ElasticBody,
    actuation: Array,
    name: str,
    *,
    frame_seconds: float = 0.008,
    per_cell: int = scenes.PER_CELL,
) -> Array:
    """Stretch of a driven cube at every frame: the slope of x over its initial values; with the common checks."""
    fidelity = replace(scenes.fidelity(64), particles_per_cell=per_cell)
    solver = Solver(scenes.flight(body, 3.0), fidelity, frame_seconds=frame_seconds)
    rollout, energies = record.episode(solver, actuation[:, None, None])
    record.robot_volume(rollout, 0.05, f"{name}: ")
    record.no_drift(solver, energies, f"{name}: ")
    centred = body.positions[:, 0] - body.positions[:, 0].mean()
    stretch: Array = rollout.positions[:, 0, :, 0] @ centred / (centred @ centred)
    return stretch


def _approaches(record: EpisodeRecorder, stretch: Array, still: float, prefix: str = "") -> None:
    """Check that the mean stretch is near its equilibrium."""
    away = abs(float(stretch.mean()) - still) / abs(1.0 - still)
    record.at_most(f"{prefix}distance from equilibrium at the end / at first", away, 0.3)


@case("muscle-step")
def muscle_step(record: EpisodeRecorder) -> None:
    """Full contraction at once, and a push at once of half the stress at which a fibre loses its equilibrium.

    The fibre overshoots, but not beyond the stretch at which it has as much energy as initially.
    """
    pulled = _drive(record, muscle_cube(3e3), np.ones(60), "pull")
    record.at_least("pull: smallest stretch / turning point", float(pulled.min()) / turning_point(3e3), 1.0)
    pushed = _drive(record, muscle_cube(0.5 * _MU), -np.ones(60), "push")
    record.at_most("push: largest stretch / turning point", float(pushed.max()) / turning_point(-0.5 * _MU), 1.0)
    for name, stretch, tension in (("pull", pulled, 3e3), ("push", pushed, -0.5 * _MU)):
        _approaches(record, stretch[-20:], stretches_at_rest(tension)[0], f"{name}: ")


@case("muscle-near-runaway")
def muscle_near_runaway(record: EpisodeRecorder) -> None:
    """A push that rises within half a second to 0.8 of the stress without equilibrium; the fibre doubles its length.

    Beyond twice its length a body of two particles per cell and axis comes apart, so here it has three. Applied at
    once, the same push would carry the fibre beyond three times its length.
    """
    ramp = -np.minimum(np.arange(1, 121) / 60.0, 1.0)
    stretch = _drive(record, muscle_cube(0.8 * _MU, 27), ramp, "push", per_cell=27)
    still = stretches_at_rest(-0.8 * _MU)[0]
    record.at_most("largest stretch / equilibrium", float(stretch.max()) / still, 1.3)
    _approaches(record, stretch[-30:], still)
    record.remark(f"at once, the turning point is {turning_point(-0.8 * _MU):.2g}")


@case("muscle-flutter")
def muscle_flutter(record: EpisodeRecorder) -> None:
    """Full contraction and full push in turn, 200 times a second."""
    signs = np.where(np.arange(400) % 2 == 0, 1.0, -1.0)
    stretch = _drive(record, muscle_cube(3e3), signs, "flutter", frame_seconds=0.0025)
    record.at_most("largest stretch / that of a steady push", float(stretch.max()) / stretches_at_rest(-3e3)[0], 2.0)
    record.at_least("smallest stretch / that of a steady pull", float(stretch.min()) / stretches_at_rest(3e3)[0], 0.5)


@case("control-muscle-runaway")
def muscle_runaway(record: EpisodeRecorder) -> None:
    """Negative control: a push beyond mu has no equilibrium; such a muscle is refused, or its episode diverges."""
    try:
        solver = Solver(scenes.flight(muscle_cube(1.2 * _MU), 3.0), scenes.fidelity())
        rollout, _ = record.episode(solver, -np.ones((250, 1, 1)), may_diverge=True)
    except SceneError as error:
        record.holds(f"refused ({error!s:.60})", "strength" in str(error))
        return
    record.holds("flagged", bool(rollout.divergences))
    record.path_finite(rollout)


def _horseshoe() -> ElasticBody:
    """Two arms of eight cells, joined by a back of two cells, with one muscle along both inner sides."""
    h = scenes.SPACING
    x, y, z = scenes.MIDDLE
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
def fold(record: EpisodeRecorder) -> None:
    """A horseshoe closes with all its strength until its arms press on each other: nothing inverts or drifts."""
    body = _horseshoe()
    solver = Solver(scenes.flight(body, 1.0), scenes.fidelity(64), gradients=True)
    rollout, energies = record.episode(solver, np.ones((75, 1, 1)))
    tips = body.positions[:, 0] > body.positions[:, 0].max() - scenes.SPACING
    upper = tips & (body.positions[:, 1] > body.positions[:, 1].mean())
    lower = tips & ~upper
    gap = rollout.positions[:, 0, upper, 1].min(1) - rollout.positions[:, 0, lower, 1].max(1)
    record.at_most("smallest gap between the tips [cells]", float(gap.min()) / scenes.SPACING, 1.5)
    record.at_least("smallest gap between the tips [cells]", float(gap.min()) / scenes.SPACING, -1.0)
    record.robot_volume(rollout, 0.05)
    record.no_drift(solver, energies)
    adjoint = np.zeros(rollout.positions.shape)
    adjoint[-1, 0, upper, 1] = 1.0
    gradient = solver.backward(rollout, adjoint, np.zeros_like(adjoint))
    record.gradient_finite(gradient, [gradient.actuation])
