"""How much of an episode is stored for its gradient: every state where memory allows, else checkpoints."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zoobench.errors import UsageError
from zoobench.sim.model.state import IntArray

OTHER_STATES = 4 + 5
"""States of a solver besides those that are stored for the gradient: the present and the initial one, that before a
frame, and the adjoint; and five for an episode that takes finer steps than declared: the segment in which it leaves the
tape, and four halvings, after which steps 16 times finer (`step_limits.MOST_REFINEMENT`) fit again."""

SHORTEST_TAPE = 3
"""Slots for one substep and a stop."""

_LARGEST_TAPE = 2
"""Size of a tape for a whole episode by its declared substeps: as many as the budget holds are not reserved."""


@dataclass(frozen=True)
class Segmentation:
    """The segments of an episode: some whole frames each, or an equal share of one frame's substeps.

    A checkpoint is stored at the beginning of each. A single segment is written onto the tape as it is simulated. Of
    several each is simulated again onto the tape in the backward pass, and one that is too long for it by halves.

    Attributes:
        frames: control frames of a segment.
        pieces: segments of a frame; 1 where a segment has whole frames.
        slots: of the tape, for a state each.
    """

    frames: int
    pieces: int
    slots: int


def whole_frames(frames: int, slots_per_frame: int) -> Segmentation:
    """Segments of so many frames that take so many slots each."""
    return Segmentation(frames, 1, max(frames * slots_per_frame + 1, SHORTEST_TAPE))


def segment(
    frames: int, substeps: int, stops: int, *, budget: int, slot_bytes: int, state_bytes: int, other_bytes: int = 0
) -> Segmentation:
    """The whole episode on the tape if the budget holds it; else the fewest stored states with the fewest repetitions.

    With segments of L substeps a tape of L slots and a checkpoint for each segment suffice; their sum is least where L
    is about the square root of the episode's substeps, and every substep is repeated once (Chen et al. 2016). If this
    does not fit either, longer segments are halved on the way back: every halving takes one more state, and repeats
    half of the substeps once more.

    Args:
        frames: control frames of the episode, with those of its equilibration.
        substeps: declared substeps of a frame.
        stops: number of frames at whose end a world may be stopped, which takes a slot.
        budget: memory for all of these, and for the `OTHER_STATES` of the solver [bytes].
        slot_bytes, state_bytes: size of a slot of the tape and of a checkpoint [bytes].
        other_bytes: size of all else that the budget is for [bytes].

    Raises:
        UsageError: not even the least fits.
    """
    whole = frames * substeps + stops + 1
    others = OTHER_STATES * state_bytes + other_bytes
    if whole_bytes(whole, slot_bytes, state_bytes) + other_bytes <= budget:
        room = (budget - others - state_bytes) // slot_bytes
        return Segmentation(frames, 1, max(min(room, _LARGEST_TAPE * whole), SHORTEST_TAPE))
    needed = math.inf
    for halvings in range(math.ceil(math.log2(whole)) + 1):
        options = {
            _bytes(option, frames, slot_bytes, state_bytes) + halvings * state_bytes + others: option
            for option in _options(frames, substeps, int(stops > 0), halvings)
        }
        least = min(options)
        if least <= budget:
            return options[least]
        needed = min(needed, least)
    raise UsageError(
        f"Gradients of {frames} frames need at least {needed / 1e6:,.4g} MB for stored states of "
        f"{state_bytes / 1e6:,.4g} MB; {budget / 1e6:,.4g} MB are allowed. Give more memory (--memory), fewer frames "
        "or a coarser fidelity."
    )


def whole_bytes(slots: int, slot_bytes: int, state_bytes: int) -> int:
    """Memory of a whole episode of so many slots, with the checkpoint at its beginning and `OTHER_STATES` [bytes]."""
    return slots * slot_bytes + (1 + OTHER_STATES) * state_bytes


def _options(frames: int, substeps: int, stop: int, halvings: int) -> Iterator[Segmentation]:
    """Segments of every length, with a tape that holds them after so many halvings."""

    def slots(count: int, length: int) -> int:
        for _ in range(halvings):
            # a list of frames is halved between two of them, and a single one between two substeps
            count, length = (math.ceil(count / 2), length) if count > 1 else (1, math.ceil(length / 2))
        return max(count * (length + stop) + 1, SHORTEST_TAPE)

    for count in range(1, frames + 1):
        yield Segmentation(count, 1, slots(count, substeps))
    for pieces in range(2, substeps + 1):
        yield Segmentation(1, pieces, slots(1, math.ceil(substeps / pieces)))


def _bytes(option: Segmentation, frames: int, slot_bytes: int, state_bytes: int) -> int:
    return option.slots * slot_bytes + math.ceil(frames / option.frames) * option.pieces * state_bytes


def share(counts: IntArray, piece: int, pieces: int) -> IntArray:
    """Substeps of a frame's piece in every world `[worlds]`, equal to within one."""
    if pieces == 1:
        return counts
    return counts * (piece + 1) // pieces - counts * piece // pieces


@dataclass(frozen=True)
class Part:
    """Substeps of one frame that are simulated in one launch.

    Attributes:
        counts: substeps of every world `[worlds]`.
        stops: `[worlds]` whether the world is stopped after them.
        moves: `[worlds]` whether its arena is moved after them, before the next frame.
        is_first: whether they are the first piece of the frame.
        begins: `[worlds]` whether no substep of the frame is before them.
    """

    frame: int
    counts: IntArray
    stops: IntArray
    moves: IntArray
    is_first: bool
    begins: NDArray[np.bool_]

    @property
    def slots(self) -> IntArray:
        """Slots of the tape that each world takes `[worlds]`: a stop and a move take one, for the state before it."""
        return self.counts + self.stops + self.moves

    def halves(self) -> "tuple[list[Part], list[Part]]":
        """The part in two."""
        early = self.counts // 2
        none = np.zeros_like(self.stops)
        first = Part(self.frame, early, none, none, self.is_first, self.begins)
        rest = self.counts - early
        return [first], [Part(self.frame, rest, self.stops, self.moves, False, self.begins & (early == 0))]


def halves(parts: list[Part]) -> tuple[list[Part], list[Part]]:
    """Some parts in two lists, a single one in two pieces."""
    middle = (len(parts) + 1) // 2
    return (parts[:middle], parts[middle:]) if middle < len(parts) else parts[0].halves()
