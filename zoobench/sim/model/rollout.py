"""Results of a simulation: the robot's trajectory, divergences and tears, and the gradient."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zoobench.errors import Divergence
from zoobench.sim.model.segmentation import Segmentation
from zoobench.sim.model.state import IntArray, Matter

FloatArray = NDArray[np.floating]

Feedback = Callable[[int, FloatArray, FloatArray], NDArray[np.float64]]
"""Gives the actuation `[worlds, muscles]` of a frame, from its number and the robot's positions and velocities at its
beginning, `[worlds, robot, 3]` each."""

FeedbackAdjoint = Callable[[int, NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Gives the adjoints of the positions and velocities at the beginning of a frame, `[worlds, robot, 3]` each, from its
number and the adjoint of its actuation."""


@dataclass
class SubstepMeter:
    """World-substeps simulated so far.

    Attributes:
        forward, backward: of episodes, in which budgets are counted.
        equilibration: of equilibration, forward and backward.
        recomputed: forward for the second time and more, of both; how many depends on the memory at hand.
    """

    forward: int = 0
    backward: int = 0
    equilibration: int = 0
    recomputed: int = 0

    def count(self, kind: Literal["forward", "backward"], substeps: int, *, at_rest: bool) -> None:
        """Add substeps of one kind, or of equilibration."""
        name = "equilibration" if at_rest else kind
        setattr(self, name, getattr(self, name) + substeps)


class Segment(NamedTuple):
    """Where a segment of an episode begins, see `Segmentation`: at a frame and a piece of it, and its state there."""

    frame: int
    piece: int
    start: Matter


@dataclass(frozen=True)
class ArenaMove:
    """A move of a world's arena after its robot, see `moving_arena`.

    Attributes:
        axis: 0 along x, 2 along z.
        cells: how far; negative for backwards.
        renewed: `[n]` the medium's particles that were left behind.
        sources: `[n]` those whose state at time zero they took.
    """

    axis: int
    cells: int
    renewed: IntArray
    sources: IntArray


@dataclass
class Rollout:
    """One episode of all worlds, and the equilibration before it.

    Attributes:
        positions, velocities: `[frames + 1, worlds, robot, 3]` of the robot at frame boundaries [m], [m/s].
        actuation: `[frames, worlds, muscles]` as it was applied.
        tension: `[frames, worlds, robot]` active stress that follows from it [Pa]; 0 in frames that were not simulated.
        muscle_potential: `[frames + 1, worlds, muscles]` active energy per unit of activity at frame boundaries [J].
        divergences: the worlds that diverged; their remaining frames repeat the last healthy state.
        tears: the worlds whose robot tore, or whose base went into what nothing moves, as it was first found; they
            were simulated on.
        counts: `[frames, worlds]` substeps taken, 0 for a world that had diverged before; those of a frame are of equal
            length.
        retries: `[worlds]` how many times a frame was repeated with half the step.
        guarded: `[worlds]` particle-frames in which J was below its guard (`elastic.SMALLEST_J`).
        smallest_j: `[worlds]` smallest det F of the robot at the end of any frame.
        stops: `[frames, worlds]` whether the world was stopped at the end of the frame, as only equilibration does.
        asleep: `[frames, worlds, medium]` which of the medium's particles slept through it; empty where none may.
        offsets: `[frames + 1, worlds, 3]` how far the arena had moved at frame boundaries [m].
        moves: of the arena before a frame, by frame and world.
        equilibration: number of frames at the beginning in which the worlds come to rest; see `episode`.
        segmentation, segments: the stored states and their places; None and empty for a solver without gradients.
    """

    positions: FloatArray
    velocities: FloatArray
    actuation: FloatArray
    tension: FloatArray
    muscle_potential: NDArray[np.float64]
    body: dict[str, NDArray[np.float64]]
    divergences: dict[int, Divergence]
    tears: dict[int, Divergence]
    counts: IntArray
    retries: IntArray
    guarded: IntArray
    smallest_j: NDArray[np.float64]
    stops: NDArray[np.bool_]
    asleep: NDArray[np.bool_]
    offsets: NDArray[np.float64]
    moves: dict[tuple[int, int], list[ArenaMove]] = field(default_factory=dict)
    equilibration: int = 0
    segmentation: Segmentation | None = None
    segments: list[Segment] = field(default_factory=list)

    @property
    def frames(self) -> int:
        """Control frames of the episode."""
        return len(self.actuation)

    @property
    def episode(self) -> "Rollout":
        """The frames after equilibration, as an episode of its own; not for `Solver.backward`."""
        first = self.equilibration
        names = (
            "positions", "velocities", "actuation", "tension", "muscle_potential", "counts", "stops", "asleep",
            "offsets",
        )  # fmt: skip
        later = {name: getattr(self, name)[first:] for name in names}
        moves = {(frame - first, world): moves for (frame, world), moves in self.moves.items()}
        return replace(self, **later, moves=moves, equilibration=0)

    @property
    def substeps(self) -> int:
        """Substeps of the world that took the most."""
        return int(self.counts.sum(axis=0).max())

    @property
    def muscle_work(self) -> NDArray[np.float64]:
        """Work that each muscle did on the body in each frame `[frames, worlds, muscles]` [J].

        The active stress a s (F d)(F d)^T derives from the energy a Q with Q = s / 2 sum w V |F d|^2 over a muscle's
        particles (`muscle_potential`). The activity a is held through a frame, so that the work of that stress over it
        is -a times the change of Q, whatever the motion in between.
        """
        return -self.actuation * (self.muscle_potential[1:] - self.muscle_potential[:-1])


@dataclass(frozen=True)
class Gradient:
    """Derivatives of the loss by the parameters, in float64; zero in worlds that diverged.

    Attributes:
        actuation: `[frames, worlds, muscles]`.
        stiffness, density_ratio, occupancy: `[worlds, robot]`.
        fibres: `[worlds, robot, 3]`.
        by_membership: computes `muscle_membership`, which most callers need not have.
        fault: where the backward pass first met an adjoint that is not finite; empty if it never did.
    """

    actuation: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    density_ratio: NDArray[np.float64]
    occupancy: NDArray[np.float64]
    fibres: NDArray[np.float64]
    by_membership: Callable[[], NDArray[np.float64]]
    fault: str = ""

    @cached_property
    def muscle_membership(self) -> NDArray[np.float64]:
        """By the muscle membership `[worlds, robot, muscles]`."""
        return self.by_membership()
