"""Snapshots are what is simulated."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from tests.conformance.cells import POND
from tests.render.filmed import CLEAR, EACH_ENV, full_cubes, smoke_snapshot
from zoobench.errors import UsageError
from zoobench.render.recording import snapshots, vorticity
from zoobench.spec import Ref
from zoobench.testing import DOUBLE


@EACH_ENV
def test_the_robot_neither_hovers_nor_overlaps(name: str) -> None:
    """At rest, it touches what it stands on or wades in, to a particle's edge, and no water is inside it.

    A solid bed of one layer of cells, as here, does not carry a robot: it sinks into it.
    """
    shot = smoke_snapshot(name)
    if shot.medium.shape[1]:
        wet = shot.env == "shallow-water"
        gap, _ = KDTree(shot.medium[0]).query(shot.robot[0][full_cubes(shot)] if wet else shot.robot[0])
        assert (CLEAR if wet else 0.0) * shot.particle_edge < gap.min() < 1.5 * shot.particle_edge
    elif shot.scene.water is None:
        assert 0.0 < shot.robot[..., 1].min() < shot.particle_edge


def test_an_episode_moves_what_is_drawn() -> None:
    """Thirty frames of the controller leave robot and sand elsewhere; the same seed leaves them in the same place."""
    strong = Ref("sine-basis", params=(("scale", 1.0),))
    at_rest, moved, again = (
        next(iter(snapshots([Ref("desert")], controller=strong, fidelity=Ref.parse(DOUBLE), frames=frames)))
        for frames in (0, 30, 30)
    )
    assert np.abs(moved.robot - at_rest.robot).max() > 1e-3
    assert np.abs(moved.medium - at_rest.medium).max() > 1e-4
    assert (moved.robot == again.robot).all()
    assert moved.times == pytest.approx([0.24])


@pytest.mark.slow  # a bed's particles make room for a robot in tests/envs/test_base.py
def test_a_design_space_has_its_place_to_itself() -> None:
    """The water that its workspace contains is not in the picture."""
    (shot,) = snapshots([Ref("shallow-water")], design=Ref("particle"), fidelity=Ref("smoke"))
    gap, _ = KDTree(shot.medium[0]).query(shot.robot[0][full_cubes(shot)])
    assert gap.min() > CLEAR * shot.particle_edge


def test_a_negative_number_of_frames_is_refused() -> None:
    """With what to give instead."""
    with pytest.raises(UsageError, match="Give 0 or more"):
        next(snapshots([Ref("ground")], frames=-1))


def test_vorticity_of_a_vortex() -> None:
    """Water that turns as a solid body spins twice as fast as it turns, about the axis and not on the walls."""
    spacing, rate = 0.01, 3.0
    x, z = (np.arange(count) * spacing for count in (6, 4))
    flow = np.zeros((6, 5, 4, 3))
    flow[..., 0] = rate * (z + spacing / 2)
    flow[..., 2] = -rate * (x + spacing / 2)[:, None, None]
    flow[:, [0, 1, 3, 4]] = 7.0  # other layers are not looked at
    found = vorticity(flow, spacing)
    np.testing.assert_allclose(found[1:-1, 1:-1], 2 * rate)
    assert found.shape == (7, 5)
    assert not found[[0, -1]].any()
    assert not found[:, [0, -1]].any()


@pytest.mark.slow
def test_a_swimmer_stirs_the_water() -> None:
    """The water spins around it after ten frames and is at rest before."""
    strong = Ref("sine-basis", params=(("scale", 1.0),))
    spins = []
    for frames in (0, 10):
        (shot,) = snapshots([Ref.parse(POND)], controller=strong, fidelity=Ref.parse(DOUBLE), frames=frames)
        assert shot.vorticity is not None
        assert shot.vorticity.shape[0] == 1
        spins.append(float(np.abs(shot.vorticity).max()))
    assert spins[0] == 0.0
    assert spins[1] > 1.0
