"""What is stored of an episode: whole where memory allows, else the fewest states with the fewest repetitions."""

import math

import numpy as np
import pytest

from zoobench.errors import UsageError
from zoobench.sim.model.segmentation import OTHER_STATES, Part, Segmentation, halves, segment, share

STATE = 100


def _chosen(states: int, frames: int = 100, substeps: int = 9, stops: int = 0, slot: int = STATE) -> Segmentation:
    budget = (OTHER_STATES + states) * STATE
    return segment(frames, substeps, stops, budget=budget, slot_bytes=slot, state_bytes=STATE)


@pytest.mark.parametrize("stops", [0, 30])
def test_an_episode_that_fits_is_on_the_tape(stops: int) -> None:
    """With its stops, its first state and the checkpoint there; with one state less it is not."""
    whole = 100 * 9 + stops + 2
    assert _chosen(whole, stops=stops) == Segmentation(100, 1, whole - 1)
    assert _chosen(whole - 1, stops=stops).frames < 100


def test_a_tape_is_not_much_longer_than_the_episode() -> None:
    """Twice as long is enough for frames that are repeated with finer steps."""
    assert _chosen(10**6).slots == 2 * 901


@pytest.mark.parametrize(("frames", "substeps"), [(100, 9), (100, 176), (7, 1000), (400, 1)])
def test_fewest_states_grow_as_the_square_root(frames: int, substeps: int) -> None:
    """Segments of whole frames or pieces of one, within 12 % of twice the root of the episode's substeps."""
    found = _chosen(frames * substeps // 2, frames, substeps)
    stored = found.slots + math.ceil(frames / found.frames) * found.pieces
    assert found.pieces == 1 or found.frames == 1
    assert (found.frames > 1, found.pieces > 1) == (frames > 2 * substeps, substeps > 2 * frames)
    assert 2 * math.sqrt(frames * substeps) <= stored <= 1.12 * 2 * math.sqrt(frames * substeps) + 2


def test_a_dearer_slot_makes_the_tape_shorter() -> None:
    """A slot may take more memory than a checkpoint."""
    assert _chosen(400, substeps=40, slot=4 * STATE).slots < _chosen(400, substeps=40).slots


def test_every_budget_is_kept_or_refused() -> None:
    """The tape, the checkpoints and those of the halvings fit; more memory never stores less than before."""
    frames, substeps, refused = 20, 30, 0
    for states in range(1, 700):
        try:
            found = _chosen(states, frames, substeps)
        except UsageError:
            refused = states
            continue
        longest = found.frames * substeps if found.pieces == 1 else math.ceil(substeps / found.pieces)
        halvings = math.ceil(math.log2(max(1.0, longest / (found.slots - 1))))
        stored = found.slots + math.ceil(frames / found.frames) * found.pieces + halvings
        assert stored <= states, states
    assert refused < 15, "a few states do for any episode"


def test_the_least_that_is_needed_is_told() -> None:
    """The message states it, and so much is enough."""
    with pytest.raises(UsageError, match=r"at least 0\.(\d+) MB for stored states of 0\.0001 MB; 0\.001 MB") as refusal:
        _chosen(1)
    needed = round(float(str(refusal.value).split("at least ")[1].split()[0]) * 1e6)
    assert segment(100, 9, 0, budget=needed, slot_bytes=STATE, state_bytes=STATE)
    with pytest.raises(UsageError):
        segment(100, 9, 0, budget=needed, slot_bytes=STATE, state_bytes=STATE, other_bytes=1)


def test_pieces_and_halves_add_up() -> None:
    """In every world, however few its substeps are, with stops and moves after the last alone."""
    counts, stops, moves = np.array([7, 0, 2]), np.array([1, 0, 0]), np.array([0, 0, 1])
    pieces = np.array([share(counts, piece, 3) for piece in range(3)])
    np.testing.assert_array_equal(pieces.sum(axis=0), counts)
    assert np.ptp(pieces[:, 0]) == 1
    (early,), (late,) = halves([Part(4, counts, stops, moves, True, np.array([True, True, True]))])
    np.testing.assert_array_equal(early.counts + late.counts, counts)
    np.testing.assert_array_equal([early.slots, late.slots], [[3, 0, 1], [5, 0, 2]])
    assert (early.is_first, late.is_first) == (True, False)
    np.testing.assert_array_equal([early.begins, late.begins], [[True] * 3, [False, True, False]])
    assert [len(half) for half in halves([early, late, late])] == [2, 1]
