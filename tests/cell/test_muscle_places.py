"""Where muscles are: along the body, and to which side they bend it."""

from dataclasses import replace

import numpy as np
import pytest

from zoobench import registry
from zoobench.cell.muscle_places import muscle_places, placed_on
from zoobench.cell.robot import Robot
from zoobench.controllers.sine_basis import SineBasis
from zoobench.controllers.travelling_wave import TravellingWave
from zoobench.designs.base import Body
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref


def body_of(text: str, spacing: float = 1 / 64) -> Body:
    """The body of a design."""
    body: Body = registry.create(Kind.DESIGN, Ref.parse(text)).body(Fidelity(spacing))
    return body


def test_a_block_is_its_rows_and_columns() -> None:
    """Centres at a quarter and three quarters from the front; left against right, though it is as high as wide."""
    places = muscle_places(body_of("block"))
    np.testing.assert_allclose(places.back, np.repeat([0.75, 0.25], 4), atol=0.002)
    np.testing.assert_allclose(places.side, np.tile([-1.0, -1.0, 1.0, 1.0], 2))


def test_a_whale_bends_up_and_down_and_a_fish_from_side_to_side() -> None:
    """Back against belly, left against right; steering fins, whose fibres run outwards, hardly take part."""
    for name, words in (("orca", ("back", "belly")), ("fish", ("right", "left"))):
        body = body_of(name)
        side = muscle_places(body).side
        for word, sign in zip(words, (1, -1), strict=True):
            axial = [n for n, muscle in enumerate(body.muscles) if word in muscle and "fin" not in muscle]
            assert len(axial) >= 3
            assert (sign * side[axial] > 0.4).all(), (name, side)


@pytest.mark.slow
def test_a_whale_turns_and_rises_by_paired_muscles() -> None:
    """Those of its two front segments bend it to the right and up; a fish's bend it sideways alone."""
    body = body_of("orca[paired=true]")
    places = muscle_places(body)
    for n, muscle in enumerate(body.muscles):
        paired = "left" in muscle or "right" in muscle
        assert paired == (places.back[n] < 0.5)
        expected = {"left": -1.0, "right": 1.0}.get(muscle.split("-")[-1], 0.0)
        assert places.right[n] == pytest.approx(expected, abs=0.1)
        assert abs(places.up[n] - (1.0 if "back" in muscle else -1.0)) < 0.1
    assert np.abs(muscle_places(body_of("orca")).right).max() < 0.1  # unless they are asked for
    fish = muscle_places(body_of("fish"))
    np.testing.assert_array_equal(fish.right, fish.side)
    assert np.abs(fish.up).max() < 0.1


def test_places_are_those_of_every_fidelity() -> None:
    """To a hundredth of the length."""
    coarse, fine = (muscle_places(body_of("fish", spacing)) for spacing in (1 / 64, 1 / 128))
    np.testing.assert_allclose(coarse.back, fine.back, atol=0.01)


def test_a_body_that_no_muscle_bends_is_refused() -> None:
    """One muscle all over it; the message says what to choose."""
    with pytest.raises(UsageError, match="sine-basis"):
        muscle_places(body_of("block[rows=1,columns=1,layers=1]"))


def test_channels_of_a_base_are_no_muscles() -> None:
    """They rest in a wave, leave the places of the muscles as they are, and are not counted with them."""
    body = body_of("block")
    based = replace(
        body,
        muscles=(*body.muscles, "base-ahead", "base-up", "base-right"),
        muscle_membership=np.pad(body.muscle_membership, ((0, 0), (0, 3))),
        base_speed=0.1,
    )
    alone, places = muscle_places(body), muscle_places(based)
    np.testing.assert_allclose(places.back, [*alone.back, 0.5, 0.5, 0.5])
    np.testing.assert_allclose(places.side, [*alone.side, 0.0, 0.0, 0.0])
    with pytest.raises(UsageError, match="None of the 8 muscles"):
        muscle_places(body_of("gripper[base_speed=0.1]"))


def test_a_robot_places_its_controller() -> None:
    """A wave knows the muscles of its body; a controller that does not ask for them stays as it is."""
    robot = Robot.of(Ref("block"), Ref("travelling-wave"), Fidelity(1 / 32), Ref("movement-speed"))
    assert isinstance(robot.controller, TravellingWave)
    assert robot.parameter_count == 4
    assert robot.controller._places is not None
    np.testing.assert_allclose(robot.controller._places.back, np.repeat([0.75, 0.25], 4), atol=0.01)
    basis = SineBasis()
    assert placed_on(robot.body, basis) is basis
