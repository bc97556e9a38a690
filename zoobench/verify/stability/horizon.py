"""Gradients through a whole episode in 32 bits: what rounding does to the adjoint, and what it does to the path.

The gradient of an episode with contact jumps wherever the path crosses a kink, at which a node touches down or lets go
in another substep. Two paths as near as rounding may differ in their gradients by a per cent, though both gradients are
exact. So 32 bits g and 64 bits G are compared in two parts, each on its own path p and P:

    g(p) - G(P) = [g(p) - G(p)] + [G(p) - G(P)].

The first part is the arithmetic of the adjoint on one path: it knows no kinks. The second is a difference of two exact
gradients: a property of the scene and not of the precision, small where nothing touches the ground.
"""

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.sim.adjoint import Adjoint
from zoobench.sim.model.rollout import FloatArray
from zoobench.sim.model.scene import Scene
from zoobench.spec import Ref
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import healthy

if TYPE_CHECKING:
    from zoobench.sim.model.rollout import Rollout
    from zoobench.sim.model.state import Matter
    from zoobench.sim.solver import Solver


FRAMES = 200
SUBSTEPS = 18
"""In a control frame, always: a step that is chosen by the state would be chosen otherwise by a rounded one."""

_EPSILON = float(np.finfo(np.float32).eps)


@dataclass(frozen=True)
class Gap:
    """What 32 bits change of one episode.

    Attributes:
        exact: gradient in 64 bits by the actuation, `[frames, muscles]`.
        arithmetic: g(p) - G(p), by the norm of G(p): both adjoints on the path of 32 bits.
        path: G(p) - G(P), by the norm of G(P): both in 64 bits.
        total: g(p) - G(P), by the norm of G(P).
        distance: the farthest that a coordinate is from where it is in 64 bits [m].
        reach: the largest coordinate, from the grid's first node [m].
        nudged: what `path` is for paths of 64 bits that begin as far from P as p is on the average.
    """

    exact: Array
    arithmetic: float
    path: float
    total: float
    distance: float
    reach: float
    nudged: tuple[float, ...]


class WholePath(Adjoint):
    """A backward pass of an episode in one segment, along its own states or along those of another precision.

    Attributes:
        path: the states after every substep; its own once it has run.
    """

    def __init__(self, solver: "Solver", rollout: "Rollout", path: "Matter | None" = None) -> None:
        super().__init__(solver.simulation, rollout)
        self.path = path

    def _recompute(self, segment: int) -> None:
        if self.path is None:
            super()._recompute(segment)
            self.path = self._tape
        else:
            for target, source in zip(self._tape.tensors(), self.path.tensors(), strict=True):
                target.copy_(source)


def walker(precision: int, frames: int, *, contact: bool = True, nudge: float = 0.0, seed: int = 0) -> "Solver":
    """The caterpillar on rough ground, or without `contact` and weight in mid-air; at first `nudge` [m] beside it."""
    from zoobench.sim.solver import Solver

    grid = scenes.fidelity(precision, step=0.008 / SUBSTEPS)
    body = registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid)
    scene: Scene = registry.create(Kind.ENV, Ref("ground")).scene(body, grid)
    robot = scene.robot
    places = robot.positions + nudge / np.sqrt(3.0) * np.random.default_rng(seed).normal(size=robot.positions.shape)
    if not contact:
        places[:, 1] += 0.5 * (scene.lower[1] + scene.upper[1])
        scene = replace(scene, ground=None, gravity=scenes.STILL)
    scene = replace(scene, robot=replace(robot, positions=places))
    return Solver(scene, grid, gradients=True, checkpoint_interval=frames)


def wave(solver: "Solver", frames: int) -> Array:
    """A wave of the muscles along the body, `[frames, 1, muscles]`."""
    times = 0.008 * np.arange(frames)[:, None, None]
    phases = np.linspace(0.0, 2.0 * np.pi, solver.muscle_count, endpoint=False)
    actuation: Array = 0.8 * np.sin(2.0 * np.pi * 1.5 * times + phases)
    return actuation


def measure(probe: Probe, *, contact: bool, frames: int = FRAMES, nudges: int = 0) -> Gap:
    """The gap of how far the caterpillar gets, or in mid-air, where nobody gets anywhere, of its length."""
    rollouts, gradients = {}, {}
    path, pull = None, np.zeros(0)
    for precision in (32, 64):
        solver = walker(precision, frames, contact=contact)
        rollout = solver.run(wave(solver, frames))
        healthy(probe, rollout)
        probe.note_rollout(solver, rollout)
        pull = _pull(rollout.positions, contact=contact)
        adjoint = WholePath(solver, rollout)
        found = adjoint.run(pull, np.zeros_like(pull))
        probe.holds(f"{precision} bits: finite", not found.fault and bool(np.isfinite(found.actuation).all()))
        rollouts[precision], gradients[precision] = rollout, found.actuation[:, 0]
        path = path or adjoint.path
    exact, positions = gradients[64], rollouts[64].positions
    beside = WholePath(solver, rollouts[32], path).run(pull, np.zeros_like(pull)).actuation[:, 0]
    apart = rollouts[32].positions - positions
    nudge = float(np.sqrt(np.square(apart).sum(-1).mean()))
    return Gap(
        exact=exact,
        arithmetic=_relative(gradients[32], beside),
        path=_relative(beside, exact),
        total=_relative(gradients[32], exact),
        distance=float(np.abs(apart).max()),
        reach=float((positions - solver.origin).max()),
        nudged=tuple(_relative(_nudged(nudge, seed, pull, frames, contact=contact), exact) for seed in range(nudges)),
    )


def _nudged(nudge: float, seed: int, pull: Array, frames: int, *, contact: bool) -> Array:
    solver = walker(64, frames, contact=contact, nudge=nudge, seed=seed)
    found = solver.backward(solver.run(wave(solver, frames)), pull, np.zeros_like(pull))
    gradient: Array = found.actuation[:, 0]
    return gradient


def _pull(positions: FloatArray, *, contact: bool) -> Array:
    """Derivative by the path of the mean x at its end, or of how far the front half's is before the rear half's."""
    pull = np.zeros(positions.shape)
    along = positions[0, ..., 0]
    pull[-1, ..., 0] = (1.0 if contact else np.sign(along - np.median(along))) / along.size
    return pull


def _relative(found: Array, expected: Array) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def judge(probe: Probe, gap: Gap, *, contact: bool, frames: int) -> None:
    """What 32 bits must hold; see `long_horizon` for the bounds."""
    where, substeps = "on the ground" if contact else "in mid-air", frames * SUBSTEPS
    probe.below(f"{where}, adjoint of 32 bits against 64 on its path", gap.arithmetic, substeps * _EPSILON)
    half = 0.5 * float(np.spacing(np.float32(gap.reach)))
    probe.below(f"{where}, path of 32 bits beside that of 64 [m]", gap.distance, substeps * half)
    if contact:
        nudged = ", ".join(f"{found:.2g}" for found in gap.nudged)
        probe.remark(f"{where}, 32 bits against 64 {gap.total:.2g}, 64 bits against 64 as far beside {nudged}")
    else:
        probe.below(f"{where}, 32 bits against 64", gap.total, 1e-3)


@case("long-horizon", fast=False)
def long_horizon(probe: Probe) -> None:
    """A caterpillar's gradient through 3600 substeps, on rough ground and in mid-air: no explosion, right in 32 bits.

    With contact the whole difference between 32 and 64 bits has no bound: it is that of two exact gradients on either
    side of a few kinks, 1 % here, and the same between two paths of 64 bits as far apart. That is shown and not judged.
    What is judged, with n substeps and the relative rounding error eps of 32 bits:

    - The adjoint of 32 bits against that of 64 bits on the same states, kinks and all: n eps. Every substep's reverse
      rounds by about eps, and the gradient does not explode, as is judged first, so n roundings of one sign make no
      more. An adjoint that is wrong by 1 % in 32 bits is more than twenty times that far off.
    - The path of 32 bits beside that of 64: n times half an ulp of the largest coordinate. Every substep rounds x so,
      at worst always to the same side, and neighbouring paths do not part: those of 64 bits keep their distance.
    - In mid-air, where there are no kinks: the whole difference, 1e-3. The gradient is smooth in the path there and
      changes by about distance by grid spacing, with which 3e-5 m make 1e-3 at worst.
    """
    ground = measure(probe, contact=True, nudges=2)
    window = round(100 / SUBSTEPS)  # frames of about 100 substeps
    norms = [float(np.linalg.norm(part)) for part in np.array_split(ground.exact, FRAMES // window)]
    earlier = [before / after for before, after in itertools.pairwise(norms)]
    probe.below("largest growth of the gradient per 100 substeps", float(np.max(earlier)), 10.0)
    judge(probe, ground, contact=True, frames=FRAMES)
    judge(probe, measure(probe, contact=False), contact=False, frames=FRAMES)
