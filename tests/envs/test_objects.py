"""Objects about a robot: where they begin, how large, heavy and stiff they are, and what is refused."""

from dataclasses import replace
from itertools import chain, combinations, pairwise
from typing import Any

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.firm_ground import rest_frame_fault
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.envs.object_solids import PROPORTIONS
from zoobench.envs.objects import Objects
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.spec import Ref

GRID = Fidelity(1 / 64)
H = GRID.grid_spacing
EDGE = GRID.particle_edge


@pytest.fixture(scope="module")
def block() -> Body:
    """A robot with a flat back."""
    body: Body = registry.create(Kind.DESIGN, Ref("block")).body(GRID)
    return body


def _scene(body: Body, seconds: float = 1.6, slope: float = 0.0, **given: Any) -> Scene:
    params = [f"{name}={value}" for name, value in ({"object": "box", "slope": slope} | given).items()]
    env: Environment = registry.create(Kind.ENV, Ref.parse(f"ground[{','.join(params)}]"))
    return env.scene(body, GRID, seconds)


def _bounds(scene: Scene, name: str = "object") -> tuple[Array, Array]:
    """Corners of a body [m]."""
    body = scene.robot if name == "robot" else next(each.body for each in scene.objects if each.name == name)
    return body.positions.min(axis=0) - EDGE / 2, body.positions.max(axis=0) + EDGE / 2


def _away(scene: Scene, name: str = "object") -> Array:
    """Place of an object relative to the robot, ahead and right `[2]` [m]."""
    found: Array = (_bounds(scene, name)[0] - _bounds(scene, "robot")[0])[[0, 2]]
    return found


@pytest.mark.parametrize("kind", PROPORTIONS)
def test_an_object_has_its_size_mass_and_stiffness(kind: str, block: Body) -> None:
    """Whatever its shape: that of the largest particles' cubes, to a particle."""
    scene = _scene(block, object=kind, object_size=0.2, object_mass=0.3, object_stiffness=4e4)
    (thing,) = scene.objects
    low, high = _bounds(scene)
    np.testing.assert_allclose(high - low, 0.2 * np.array(PROPORTIONS[kind]), atol=EDGE)
    assert thing.body.masses.sum() == pytest.approx(0.3, rel=1e-12)
    assert thing.body.material.youngs_modulus == 4e4
    assert low[1] == pytest.approx(0.0, abs=scene.ground.skin.thickness if scene.ground else 0.0)


@pytest.mark.parametrize(
    ("place", "axis", "sign"), [("ahead", 0, 1), ("behind", 0, -1), ("right", 2, 1), ("left", 2, -1)]
)
def test_an_object_is_as_far_away_as_is_said(place: str, axis: int, sign: int, block: Body) -> None:
    """Between the surfaces, along x or z; shifted across, and not otherwise."""
    for shift in (0.0, 0.05):
        scene = _scene(block, object_place=place, object_gap=0.04, object_shift=shift)
        robot, thing = _bounds(scene, "robot"), _bounds(scene)
        near, far = (1, 0) if sign > 0 else (0, 1)
        assert sign * (thing[far][axis] - robot[near][axis]) == pytest.approx(0.04, abs=1e-9)
        across = 2 - axis
        middle = [(each[0] + each[1])[across] / 2 for each in (robot, thing)]
        assert middle[1] - middle[0] == pytest.approx(shift, abs=1e-9)


def test_left_and_right_are_mirrored(block: Body) -> None:
    """To rounding: the robot's middle plane is that of the arena."""
    left, right = (_scene(block, object="ball", object_place=side) for side in ("left", "right"))
    width = right.lower[2] + right.upper[2]
    mirrored = left.objects[0].body.positions * [1.0, 1.0, -1.0] + [0.0, 0.0, width]
    order = [np.lexsort(np.round(each, 9).T) for each in (mirrored, right.objects[0].body.positions)]
    np.testing.assert_allclose(mirrored[order[0]], right.objects[0].body.positions[order[1]], atol=1e-12)


def test_several_stand_in_a_row_or_on_each_other(block: Body) -> None:
    """With the gap between two of them, and a quarter of a cell upwards, in an arena that has room for all."""
    row = _scene(block, seconds=0.1, object_count=3, object_gap=0.03)
    names = ["object", *(f"object-{number}" for number in range(1, 3))]
    assert [each.name for each in row.objects] == names
    for near, far in pairwise(names):
        assert _bounds(row, far)[0][0] - _bounds(row, near)[1][0] == pytest.approx(0.03, abs=1e-9)
    tower = _scene(block, object_place="back", object_count=2)
    for below, above in (("robot", "object"), ("object", "object-1")):
        assert _bounds(tower, above)[0][1] - _bounds(tower, below)[1][1] == pytest.approx(0.25 * H, abs=0.01 * H)


def test_a_seed_decides_where_objects_are_and_how_heavy(block: Body) -> None:
    """The same draw for place and mass whenever it is asked for, within the spread; 0 of it is no draw at all."""
    scenes = [_scene(block, object_spread=0.02, object_mass_spread=0.3, object_seed=seed) for seed in (1, 1, 2, 3, 4)]
    plain = _scene(block)
    moved = np.array([_away(each) - _away(plain) for each in scenes])
    masses = np.array([each.objects[0].body.masses.sum() for each in scenes])
    assert (moved[0] == moved[1]).all()
    assert len(np.unique(np.round(moved[1:], 9))) == 8
    assert len(np.unique(np.round(masses[1:], 9))) == 4
    assert (np.abs(moved) <= 0.02).all()
    assert (np.abs(masses / 0.08 - 1.0) <= 0.3).all()
    unmoved = _scene(block, object_seed=7).objects[0].body
    np.testing.assert_array_equal(unmoved.positions, plain.objects[0].body.positions)
    assert unmoved.material == plain.objects[0].body.material


@pytest.mark.parametrize(
    "place", ["behind", *(pytest.param(place, marks=pytest.mark.slow) for place in ("left", "right")), "back"]
)
def test_objects_are_drawn_at_every_place(place: str, block: Body) -> None:
    """By the same way along and across, and all of a row together."""
    given: dict[str, Any] = {"object_place": place, "object_count": 2}
    plain, drawn = _scene(block, **given), _scene(block, object_spread=0.01, object_seed=3, **given)
    ways = [_away(drawn, name) - _away(plain, name) for name in ("object", "object-1")]
    ahead = _away(_scene(block, object_spread=0.01, object_seed=3)) - _away(_scene(block))
    np.testing.assert_allclose(ways, [ahead, ahead], atol=1e-9)


def _middles(scene: Scene) -> Array:
    """Middles of the objects by their numbers, relative to the first one's, ahead and right `[object_count, 2]` [m]."""
    found = {each.name: each.body.positions.mean(axis=0)[[0, 2]] for each in scene.objects}
    names = ["object", *(f"object-{number}" for number in range(1, len(found)))]
    return np.array([found[name] - found["object"] for name in names])


def test_rubble_lies_ahead_in_rows_of_three_and_two(block: Body) -> None:
    """Ten of them, with the gap between any two of a row, the first in the middle of the way."""
    scene = _scene(block, seconds=0.1, object_place="rubble", object_count=10, object_gap=0.03, object_shift=0.01)
    expected = [(row, across) for row in range(4) for across in ((0, -1, 1), (-0.5, 0.5))[row % 2]]
    np.testing.assert_allclose(_middles(scene), (0.0625 + 0.03) * np.array(expected), atol=1e-9)
    np.testing.assert_allclose(_away(scene), _away(_scene(block, object_gap=0.03, object_shift=0.01)), atol=1e-9)


@pytest.mark.parametrize(
    ("given", "step"),
    [
        ({"object_place": "ahead", "object_count": 10}, 0.0825),
        ({"object_place": "rubble", "object_count": 10}, 0.0825),
        ({"object_place": "back", "object_count": 8, "object": "sheet", "object_size": 0.16}, 0.035),
    ],
)
def test_no_two_beside_each_other_share_a_velocity_field(given: dict[str, Any], step: float, block: Body) -> None:
    """There are three fields, and another object between any two of the same one; three objects have one each."""
    scene = _scene(block, seconds=0.1, **given)
    assert len(scene.field_objects) == 3
    fields: list[list[Array]] = []
    for each in scene.objects:
        fields += [] if each.shares else [[]]
        fields[-1].append(each.body.positions.mean(axis=0))
    for one, other in chain.from_iterable(combinations(field, 2) for field in fields):
        assert np.abs(one - other).max() > 1.4 * step
    few = _scene(block, seconds=0.1, **given | {"object_count": 3})
    assert [each.name for each in few.objects] == ["object", "object-1", "object-2"]
    assert few.field_objects == few.objects


def test_every_piece_of_rubble_is_drawn_by_itself(block: Body) -> None:
    """Within the spread, along and across; in a row of ten all are moved alike."""
    given: dict[str, Any] = {"seconds": 0.1, "object_count": 10, "object_spread": 0.01}
    for place, ways in (("rubble", 10), ("ahead", 1)):
        plain, drawn = (_scene(block, object_place=place, **given | more) for more in ({"object_spread": 0}, {}))
        moved = [_away(drawn, each.name) - _away(plain, each.name) for each in plain.objects]
        found = np.round(moved, 9)
        assert len(np.unique(found, axis=0)) == ways
        assert (np.abs(found) <= 0.01).all()


def test_kinds_take_turns(block: Body) -> None:
    """Both are as dense, and the first has the mass that was asked for."""
    scene = _scene(block, seconds=0.1, object_other="ball", object_count=4, object_mass=0.1)
    masses = {each.name: float(each.body.masses.sum()) for each in scene.objects}
    ball = 0.1 * np.pi / 6
    assert masses == pytest.approx({"object": 0.1, "object-1": ball, "object-2": 0.1, "object-3": ball}, rel=1e-9)
    np.testing.assert_allclose(_middles(scene)[:, 0], (0.0625 + 0.02) * np.arange(4), atol=1e-6)


@pytest.mark.parametrize(
    ("place", "velocity"),
    [("ahead", (-0.4, 1.0, 0)), ("behind", (0.4, 1.0, 0)), ("left", (0, 1.0, 0.4)), ("right", (0, 1.0, -0.4)),
     ("back", (0.4, 1.0, 0))],
)  # fmt: skip
def test_an_object_comes_towards_the_robot(place: str, velocity: tuple[float, float, float], block: Body) -> None:
    """With the speeds asked for, every particle of it; from the back it goes ahead. Else it is at rest."""
    (thing,) = _scene(block, object_place=place, object_speed=0.4, object_speed_up=1.0).objects
    np.testing.assert_array_equal(np.unique(thing.body.velocities, axis=0), [velocity])
    assert not _scene(block, object_place=place).objects[0].body.velocities.any()


def test_an_arena_has_room_for_an_object_that_is_fast(block: Body) -> None:
    """As long as an episode, whatever its direction."""
    slow, fast = (_scene(block, object_speed=speed).upper[0] for speed in (0.5, 2.0))
    assert fast - slow == pytest.approx(2 * 1.5 * 1.6, abs=2 * H)


def test_an_object_lies_on_a_slope(block: Body) -> None:
    """No particle is below the ground, and one is within its skin."""
    scene = _scene(block, slope=10.0)
    assert scene.ground is not None
    heights = scene.heights_above_ground(scene.objects[0].body.positions) - EDGE / 2
    assert -EDGE / 2 < heights.min() < scene.ground.skin.thickness


def test_an_arena_with_objects_does_not_follow_its_robot(block: Body) -> None:
    """It stays where they are, and is as before without any."""
    assert not _scene(block).follows
    assert _scene(block, object="none").follows
    assert not _scene(block, object="none").objects


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"object_size": 0.0}, "object_size of 0"),
        ({"object_size": 1e9}, "holds 2"),
        pytest.param({"object_size": 0.45}, "does not fit into the arena", marks=pytest.mark.slow),
        ({"object": "sheet"}, "0.8 cells of 0.01562 m; 2 are needed"),
        ({"object_place": "back", "object_shift": 1.0}, "No part of the robot is below"),
        ({"object_place": "back", "object_gap": 0.0}, "has no object_gap"),
        ({"object_place": "back", "object_height": 0.1}, "object_height of 0.1 m on the robot's back"),
        ({"object_height": -0.1}, "object_height of -0.1"),
        ({"object_place": "back", "object_count": 3, "object_size": 0.16}, "does not fit into the arena"),
        ({"object_mass": 1e6}, "sinks into the ground"),
        ({"object_mass": -1.0}, "object_mass of -1 kg is not possible. Give a positive one; in water on a grid 0"),
        ({"object_mass": 0.0}, "object_mass of 0 kg is that of water on a grid"),
        ({"object_friction": -0.1}, "object_friction of -0.1"),
        ({"object_gap": -0.1}, "object_gap of -0.1"),
        ({"object_gap": 1e3}, "grid cells, too many to hold.* nearer objects"),
        ({"object_shift": 1e9}, "grid cells, too many to hold"),
        ({"object_count": 0}, "Give 1 to 10"),
        ({"object_count": 11}, "Give 1 to 10"),
        ({"object_other": "ball"}, "object_other=ball has no effect on 1 of object=box. Leave it out"),
        ({"object_other": "box", "object_count": 2}, "object_other=box has no effect on 2 of object=box"),
        ({"object_other": "mesh", "object_count": 2}, "with no object_file is not possible"),
        ({"object_place": "rubble", "object_spread": 0.02}, "into another. Give an object_gap of 0.04 m or more"),
        ({"object": "cube"}, "not offered"),
        ({"object_spread": 0.03}, "into the robot. Give an object_gap of 0.03 m or more"),
        ({"object_spread": -0.1}, "object_spread of -0.1"),
        ({"object_speed": -2.1}, "begins with -2.1 and 0 m/s is not possible. Give"),
        ({"object_place": "below"}, "A box of 0.0625 m has no room below a robot that stands on the ground. Choose a"),
        ({"object_place": "below", "object_count": 2}, "object_count of 2 below the robot is not possible"),
        ({"object_mass_spread": 1.0}, "object_mass_spread of 1"),
        ({"object_seed": -1}, "^An object_seed of -1 is not possible. Give 0 to"),
        ({"object_seed": 99999999999999999999}, "^An object_seed of 99999999999999999999 is not possible"),
    ],
)
def test_impossible_objects_are_refused(given: dict[str, Any], told: str, block: Body) -> None:
    """With what was given and a remedy, and never in the robot's name."""
    with pytest.raises(UsageError, match=told) as caught:
        _scene(block, **given)
    assert "the robot lie outside" not in str(caught.value)


@pytest.mark.parametrize(
    ("env", "told"),
    [
        ("ground[object_size=0.1]", "object_size=0.1 has no effect without an object. .* as in object=box"),
        ("desert[object_seed=3]", "object_seed=3 has no effect without an object"),
        ("ocean[object_mass=0.08]", "object_mass=0.08 has no effect without an object"),
        ("ice[obstacle_opening=0.1]", "obstacle_opening=0.1 has no effect without an obstacle. .* as in obstacle=slot"),
    ],
)
def test_settings_of_what_is_not_there_are_refused(env: str, told: str) -> None:
    """They would make new runs of the same numbers; a default that is stated makes none."""
    with pytest.raises(UsageError, match=told):
        registry.create(Kind.ENV, Ref.parse(env))


@pytest.mark.parametrize("env", ["ground[object_size=0.0625,obstacle_opening=0.05]", "ocean[object_mass=0]"])
def test_defaults_of_what_is_not_there_may_be_stated(env: str) -> None:
    """They are those of the environment."""
    assert not registry.create(Kind.ENV, Ref.parse(env)).objects


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(
    "name",
    [
        *("object_size", "object_mass", "object_gap", "object_shift", "object_friction"),
        *("object_speed", "object_speed_up"),
    ],
)
def test_no_number_may_be_infinite(name: str, value: float) -> None:
    """Also from Python, where no text is parsed."""
    with pytest.raises(UsageError, match="is not possible"):
        Objects(object="box", **{name: value})


def test_a_robot_in_its_rest_frame_meets_no_objects() -> None:
    """The plan says so, before anything is simulated."""
    spec = cell(environment="ground[object=box]", fidelity="smoke[robot=lagrangian]")
    assert "an object" in rest_frame_fault(spec)
    assert not rest_frame_fault(cell(fidelity="smoke[robot=lagrangian]"))


def test_an_object_within_the_robot_is_refused(block: Body) -> None:
    """A scene's own check, with the name that the environment gave."""
    scene = _scene(block)
    with pytest.raises(SceneError, match="The object begins within the robot"):
        replace(scene, robot=scene.objects[0].body)
