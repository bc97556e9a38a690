"""Gradients through a whole episode in 32 bits: the effect of rounding on the adjoint and on the trajectory.

The gradient of an episode with contact is discontinuous where a node touches down or lifts off in another substep. Two
trajectories that differ by rounding may have gradients that differ by a per cent, though both are exact. So the
gradients g in 32 bits on its trajectory p, and G in 64 bits on its trajectory P, are compared in two parts:

    g(p) - G(P) = [g(p) - G(p)] + [G(p) - G(P)].

The first part is the arithmetic of the adjoint on one trajectory, without discontinuities. The second is the difference
of two exact gradients: a property of the scene and not of the precision, small without contact.
"""

import itertools
from dataclasses import dataclass, replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.adjoint import Adjoint
from zoobench.sim.kernels.layout import KEPT
from zoobench.sim.model.rollout import FloatArray, Rollout
from zoobench.sim.model.segmentation import Part
from zoobench.sim.model.state import IntArray, Matter
from zoobench.sim.solver import Solver
from zoobench.sim.tape import Tape
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case

FRAMES = 200
SUBSTEPS = 18
"""Per control frame, fixed: steps chosen by the state would depend on its rounding."""

_EPSILON = float(np.finfo(np.float32).eps)


@dataclass(frozen=True)
class Gap:
    """Differences between an episode in 32 and in 64 bits.

    Attributes:
        exact: gradient in 64 bits by the actuation, `[frames, muscles]`.
        arithmetic: g(p) - G(p) over the norm of G(p): both adjoints on the trajectory of 32 bits.
        total: g(p) - G(P) over the norm of G(P).
        distance: largest difference of a coordinate [m].
        reach: largest coordinate, from the grid's first node [m].
        nudged: G(q) - G(P) over the norm of G(P), for trajectories q in 64 bits that start as far from P as p is on
            average.
    """

    exact: Array
    arithmetic: float
    total: float
    distance: float
    reach: float
    nudged: tuple[float, ...]


class SingleSegment(Adjoint):
    """A backward pass of an episode in one segment, through its own states or those of another precision.

    Args:
        states: those after every substep; the rollout's own if None.
    """

    def __init__(self, solver: Solver, rollout: Rollout, states: Matter | None = None) -> None:
        super().__init__(solver.simulation, rollout, Tape(solver.simulation, rollout.substeps + 1))
        self._given = states

    @property
    def states(self) -> Matter:
        """The states that the pass went through."""
        return self._tape.states

    def _recompute(self, start: Matter, parts: list[Part], first: IntArray, segment: int | None) -> None:
        if self._given is None:
            super()._recompute(start, parts, first, segment)
        else:
            for target, source in zip(self.states.tensors(), self._given.tensors(), strict=True):
                target.copy_(source)
            self.states.window[:, :, KEPT] = 0  # the momenta are those of the other precision


def walker(precision: int, frames: int, *, contact: bool = True, nudge: float = 0.0, seed: int = 0) -> Solver:
    """The caterpillar on rough ground, or without ground and gravity in mid-air; displaced by `nudge` [m] at random."""
    grid = scenes.fidelity(precision, step=0.008 / SUBSTEPS)
    scene = scenes.caterpillar_scene(grid)
    robot = scene.robot
    places = robot.positions + nudge / np.sqrt(3.0) * np.random.default_rng(seed).normal(size=robot.positions.shape)
    if not contact:
        places[:, 1] += 0.5 * (scene.lower[1] + scene.upper[1])
        scene = replace(scene, ground=None, gravity=scenes.STILL)
    scene = replace(scene, robot=replace(robot, positions=places))
    return Solver(scene, grid, gradients=True, checkpoint_interval=frames)


def measure(record: EpisodeRecorder, *, contact: bool, frames: int = FRAMES, nudges: int = 0) -> Gap:
    """The gap for the distance that the caterpillar covers, or for its length in mid-air."""
    rollouts, gradients, adjoints = {}, {}, {}
    loss = np.zeros(0)
    for precision in (32, 64):
        solver = walker(precision, frames, contact=contact)
        rollout = solver.run(scenes.muscle_wave(solver, frames))
        record.add_rollout(solver, rollout)
        loss = _loss_adjoint(rollout.positions, contact=contact)
        adjoints[precision] = SingleSegment(solver, rollout)  # that of 32 bits has states that are needed once more
        found = adjoints[precision].run(loss, np.zeros_like(loss))
        record.holds(f"{precision} bits: finite", not found.fault and bool(np.isfinite(found.actuation).all()))
        rollouts[precision], gradients[precision] = rollout, found.actuation[:, 0]
    exact, positions = gradients[64], rollouts[64].positions
    on_its_path = (
        SingleSegment(solver, rollouts[32], adjoints[32].states).run(loss, np.zeros_like(loss)).actuation[:, 0]
    )
    where = "on the ground" if contact else "in mid-air"
    moved = float(np.abs(positions - positions[0]).max()) / scenes.SPACING
    record.at_least(f"{where}, way of a particle, the longest [cells]", moved, 0.1)
    apart = rollouts[32].positions - positions
    nudge = float(np.sqrt(np.square(apart).sum(-1).mean()))
    return Gap(
        exact=exact,
        arithmetic=_relative(gradients[32], on_its_path),
        total=_relative(gradients[32], exact),
        distance=float(np.abs(apart).max()),
        reach=float((positions - solver.origin).max()),
        nudged=tuple(_relative(_nudged(nudge, seed, loss, frames, contact=contact), exact) for seed in range(nudges)),
    )


def _nudged(nudge: float, seed: int, loss: Array, frames: int, *, contact: bool) -> Array:
    solver = walker(64, frames, contact=contact, nudge=nudge, seed=seed)
    found = solver.backward(solver.run(scenes.muscle_wave(solver, frames)), loss, np.zeros_like(loss))
    return found.actuation[:, 0]


def _loss_adjoint(positions: FloatArray, *, contact: bool) -> Array:
    """Derivative by the positions of the final mean x, or of that of the front half less that of the rear half."""
    adjoint = np.zeros(positions.shape)
    along = positions[0, ..., 0]
    adjoint[-1, ..., 0] = (1.0 if contact else np.sign(along - np.median(along))) / along.size
    return adjoint


def _relative(found: Array, expected: Array) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def check_gap(record: EpisodeRecorder, gap: Gap, *, contact: bool, frames: int) -> None:
    """Check the bounds of 32 bits; see `long_horizon`."""
    where, substeps = "on the ground" if contact else "in mid-air", frames * SUBSTEPS
    record.at_most(f"{where}, adjoint of 32 bits against 64 on its path", gap.arithmetic, substeps * _EPSILON)
    half = 0.5 * float(np.spacing(np.float32(gap.reach)))
    record.at_most(f"{where}, path of 32 bits off that of 64 [m]", gap.distance, substeps * half)
    if contact:
        nudged = ", ".join(f"{found:.2g}" for found in gap.nudged)
        record.remark(f"{where}, 32 bits against 64 {gap.total:.2g}, 64 bits against 64 as far off {nudged}")
    else:
        record.at_most(f"{where}, 32 bits against 64", gap.total, 1e-3)


@case("long-horizon", is_fast=False)
def long_horizon(record: EpisodeRecorder) -> None:
    """A caterpillar's gradient through 3600 substeps, on rough ground and in mid-air: bounded, and accurate in 32 bits.

    With contact the whole difference between 32 and 64 bits has no bound: it is that of two exact gradients on either
    side of a few discontinuities, 1 % here, as between two trajectories of 64 bits at the same distance. It is
    reported. The bounds, with n substeps and the relative rounding error eps of 32 bits:

    - The adjoint of 32 bits against that of 64 bits on the same states: n eps. The reverse of every substep rounds by
      about eps, and the gradient does not grow exponentially, which is checked first, so that n roundings of one sign
      make no more. An adjoint that is wrong by 1 % in 32 bits exceeds the bound more than twenty times.
    - The trajectory of 32 bits against that of 64: n times half an ulp of the largest coordinate. Every substep rounds
      x by that, at worst always to the same side, and neighbouring trajectories of 64 bits keep their distance.
    - In mid-air, without contact: the whole difference, 1e-3. The gradient is a smooth function of the trajectory and
      changes by about distance over grid spacing, at worst 1e-3 for 3e-5 m.
    """
    ground = measure(record, contact=True, nudges=2)
    window = round(100 / SUBSTEPS)  # frames in about 100 substeps
    norms = [float(np.linalg.norm(part)) for part in np.array_split(ground.exact, FRAMES // window)]
    earlier = [before / after for before, after in itertools.pairwise(norms)]
    record.at_most("largest growth of the gradient per 100 substeps", np.max(earlier), 10.0)
    check_gap(record, ground, contact=True, frames=FRAMES)
    check_gap(record, measure(record, contact=False), contact=False, frames=FRAMES)
