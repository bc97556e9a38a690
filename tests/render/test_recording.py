"""Snapshots are what is simulated."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from tests.conformance.cells import POND
from tests.render.filmed import CLEAR, full_cubes, smoke_snapshots
from zoobench.errors import UsageError
from zoobench.render.recording import snapshots
from zoobench.spec import Ref


def test_the_robot_neither_hovers_nor_overlaps() -> None:
    """At rest, it touches what it stands or swims on, to a particle's edge, and no water is inside it.

    A solid bed of one layer of cells, as here, does not carry a robot: it sinks into it.
    """
    for shot in smoke_snapshots():
        if shot.medium.shape[1]:
            wet = shot.env.startswith(("shallow-water", "ocean"))
            gap, _ = KDTree(shot.medium[0]).query(shot.robot[0][full_cubes(shot)] if wet else shot.robot[0])
            assert (CLEAR if wet else 0.0) * shot.particle_edge < gap.min() < 1.5 * shot.particle_edge, shot.env
        else:
            assert 0.0 < shot.robot[..., 1].min() < shot.particle_edge, shot.env


def test_an_episode_moves_what_is_drawn() -> None:
    """Thirty frames of the controller leave robot and sand elsewhere; the same seed leaves them in the same place."""
    strong = Ref("sine-basis", params=(("scale", 1.0),))
    at_rest, moved, again = (
        next(iter(snapshots([Ref("desert")], controller=strong, fidelity=Ref("smoke"), frames=frames)))
        for frames in (0, 30, 30)
    )
    assert np.abs(moved.robot - at_rest.robot).max() > 1e-3
    assert np.abs(moved.medium - at_rest.medium).max() > 1e-4
    assert (moved.robot == again.robot).all()
    assert moved.times == pytest.approx([0.24])


def test_a_design_space_has_its_place_to_itself() -> None:
    """The water that its workspace contains is not in the picture."""
    (shot,) = snapshots([Ref.parse(POND)], design=Ref("particle"), fidelity=Ref("smoke"))
    gap, _ = KDTree(shot.medium[0]).query(shot.robot[0][full_cubes(shot)])
    assert gap.min() > CLEAR * shot.particle_edge


def test_a_negative_number_of_frames_is_refused() -> None:
    """With what to give instead."""
    with pytest.raises(UsageError, match="Give 0 or more"):
        next(snapshots([Ref("ground")], frames=-1))
