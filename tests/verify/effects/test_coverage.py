"""Effects follow from the scene of an environment, and their costs from that scene without them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from zoobench import registry
from zoobench.envs.bed import BED_THICKNESS
from zoobench.registry import Kind
from zoobench.sim.model.scene import Effect, Ground
from zoobench.sim.solver import Solver
from zoobench.spec import Ref
from zoobench_verify.effects import effect_costs
from zoobench_verify.effects.coverage import Coverage, StudiedScene, coverage, studied_scenes
from zoobench_verify.effects.effect_costs import EffectCost, Ratio, costs, in_turn, state_bytes, tensor_bytes
from zoobench_verify.effects.effect_scenes import all_elastic, as_clay, pairs

SMOKE = Ref("smoke")

# Table 6 of SoftZoo's appendix: friction, elasticity, plasticity and fluid; medium as the text has it, thickness ours.
TABLE_6 = {
    "ground": ("none", None, "high", "robot", False, ""),
    "ice": ("none", None, "low", "robot", False, ""),
    "desert": ("sand", BED_THICKNESS, "high", "robot, medium", True, ""),
    "wetland": ("mud", BED_THICKNESS, "high", "robot, medium", True, "mixed"),
    "clay": ("clay", BED_THICKNESS, "high", "robot, medium", True, ""),
    "snow": ("snow", BED_THICKNESS, "high", "robot, medium", True, ""),
    "shallow-water": ("water", 0.042, "high", "robot", False, "shallow"),
    "ocean": ("water", None, "", "robot", False, "deep"),
    "ocean[water=grid]": ("water", 0.15625, "", "robot", False, "deep"),
    "ground[object=box]": ("none", None, "high", "robot, object", False, ""),  # and what the table does not have
}

ON_SAND = "desert[object=box]"


def _studied(name: str) -> StudiedScene:
    # at smoke the caterpillar has no particle above shallow water
    return next(studied_scenes([Ref.parse(name)], Ref("draft")))


@pytest.mark.parametrize(("name", "expected"), TABLE_6.items())
def test_coverage_is_that_of_table_6(name: str, expected: tuple[object, ...]) -> None:
    """Read off the scene's effects, materials, particles and ground."""
    row = coverage(name, _studied(name).scene)
    medium, thickness, friction, elasticity, plasticity, fluid = expected
    assert (row.medium, row.friction, row.elasticity) == (medium, friction, elasticity)
    assert (row.plasticity, row.fluid) == (plasticity, fluid)
    assert row.thickness is thickness or row.thickness == pytest.approx(thickness, rel=1e-9)


def test_coverage_follows_the_scene() -> None:
    """Another friction, a deeper bed or a robot that is drowned change the row; the name has no influence."""
    scene = _studied("shallow-water").scene
    assert coverage("any", replace(scene, ground=Ground(0.1))).friction == "low"
    assert coverage("any", replace(scene, ground=None)) == replace(
        coverage("any", scene), friction="", friction_coefficient=0.0
    )
    low = replace(scene.robot, positions=scene.robot.positions * [1.0, 0.1, 1.0])
    assert coverage("any", replace(scene, robot=low)).fluid == "deep"
    assert coverage("any", replace(scene, medium=None)) == Coverage(
        "any", "none", None, "high", 0.5, "robot", False, "", ""
    )


def test_a_bed_on_hills_is_as_thick_as_on_the_level() -> None:
    """Thickness counts from the ground below; the row names the parameters."""
    hilly = Ref.parse("desert[relief=0.02]")
    (studied,) = studied_scenes([hilly], SMOKE)
    row = coverage(studied.env, studied.scene)
    assert (row.env, row.thickness) == (str(hilly), pytest.approx(BED_THICKNESS, rel=1e-6))


def test_what_meets_the_robot_is_named() -> None:
    """Objects and obstacles as in the scene, and a bed; without them the columns are as before."""
    both = coverage("any", _studied("ground[object=box,object_gap=0.12,object_count=2,obstacle=post]").scene)
    assert both.contact == "object, object-1, obstacle"
    assert both.elasticity == "robot, object, object-1, obstacle"
    assert coverage("any", _studied("desert").scene).contact == "medium"
    on_sand = coverage("any", _studied(ON_SAND).scene)
    assert (on_sand.contact, on_sand.elasticity) == ("object, medium", "robot, object, medium")


@pytest.mark.parametrize("name", [*TABLE_6, ON_SAND])
def test_a_pair_differs_in_its_effect_alone(name: str) -> None:
    """With it and without it have the same particles in the same places with the same masses."""
    fidelity = replace(_studied(name).fidelity, grid_spacing=1 / 32)
    found = list(pairs(_studied(name).scene))
    assert {pair.effect for pair in found} == _studied(name).scene.effects - {Effect.ELASTICITY}
    for pair in found:
        assert pair.on.effects - pair.off.effects == {pair.effect}
        assert not pair.off.effects - pair.on.effects
        solvers = [Solver(scene, fidelity) for scene in (pair.on, pair.off)]
        for solver in solvers:
            solver.reset()
        first, second = solvers
        assert np.array_equal(first.matter.x.numpy(), second.matter.x.numpy())
        assert np.allclose(first.parameters.mass.numpy(), second.parameters.mass.numpy(), rtol=1e-6)


def test_a_scene_without_a_bed_is_all_elastic() -> None:
    """It stays unchanged, and only mud can be made clay."""
    scene = _studied("ground").scene
    assert all_elastic(scene) is scene
    sand = _studied("desert").scene.medium
    assert sand is not None
    with pytest.raises(TypeError, match="mud was expected"):
        as_clay(sand)


EVERYWHERE = {"muscle", "damping"}
EFFECTS = {
    "ground": EVERYWHERE | {"friction"},
    "ice": EVERYWHERE | {"friction"},
    "desert": EVERYWHERE | {"friction", "contact", "plasticity"},
    "clay": EVERYWHERE | {"friction", "contact", "plasticity"},
    "snow": EVERYWHERE | {"friction", "contact", "plasticity"},
    "wetland": EVERYWHERE | {"friction", "contact", "plasticity", "fluid"},
    "shallow-water": EVERYWHERE | {"friction", "contact", "fluid"},
    "ocean": EVERYWHERE | {"fluid"},
    "ocean[water=grid]": EVERYWHERE | {"fluid"},
    "ground[object=box]": EVERYWHERE | {"friction", "contact"},
}


def test_every_environment_is_known_here() -> None:
    """A new one is measured, too."""
    assert EFFECTS.keys() == TABLE_6.keys()
    assert {Ref.parse(name).name for name in TABLE_6} == set(registry.names(Kind.ENV))


@pytest.fixture(
    scope="module",
    params=[name if name == "ground" else pytest.param(name, marks=pytest.mark.slow) for name in EFFECTS],
)
def measured(request: pytest.FixtureRequest) -> tuple[str, dict[str, EffectCost]]:
    """An environment and its costs, once; each effect of a bed compiles another one."""
    return request.param, {cost.effect: cost for cost in costs(_studied(request.param), repeats=3)}


def test_every_effect_is_measured(measured: tuple[str, dict[str, EffectCost]]) -> None:
    """The substeps counted are those of the launches timed, and a gradient has launches both ways."""
    env, found = measured
    assert found.keys() == EFFECTS[env] | {"checkpoints", "gradient"}
    for cost in found.values():
        assert cost.ratio == pytest.approx(cost.ns / cost.ns_without)
        assert cost.low is not None
        assert cost.high is not None
        assert cost.low <= cost.ratio <= cost.high
        assert cost.launches > 0
        assert cost.substeps % 3 == 0
    assert all(found[effect].launches == 3 for effect in EFFECTS[env])
    assert found["gradient"].launches == 2 * found["checkpoints"].launches


def test_a_ratio_has_its_interval() -> None:
    """Student's of the rounds' logarithms: what slows both timers of a round down is not in it."""
    found = Ratio.of([2.0, 4.0, 16.0], [1.0, 2.0, 8.0])
    assert (found.value, found.low, found.high) == pytest.approx((2.0, 2.0, 2.0))
    found = Ratio.of([1.0, 2.0, 4.0], [1.0, 1.0, 1.0])
    half = 4.302652729911275 * math.log(2.0) / math.sqrt(3.0)  # t of two degrees of freedom at 97.5 %
    assert (found.first, found.second, found.value) == pytest.approx((2.0, 1.0, 2.0))
    assert (found.low, found.high) == pytest.approx((2.0 * math.exp(-half), 2.0 * math.exp(half)))
    assert Ratio.of([3.0], [2.0]) == Ratio(pytest.approx(3.0), pytest.approx(2.0), pytest.approx(1.5), None, None)


@pytest.mark.slow
def test_a_bed_is_measured_beside_an_elastic_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plasticity of the desert, in as many launches as repeats."""
    monkeypatch.setattr(
        effect_costs, "pairs", lambda scene: (pair for pair in pairs(scene) if pair.effect is Effect.PLASTICITY)
    )
    cost = next(costs(_studied("desert"), repeats=3))
    assert (cost.effect, cost.launches, cost.ratio) == ("plasticity", 3, pytest.approx(cost.ns / cost.ns_without))


def test_gradients_cost_memory(measured: tuple[str, dict[str, EffectCost]]) -> None:
    """The states of the episode, and the adjoints beside them."""
    _, found = measured
    assert found["gradient"].bytes > found["checkpoints"].bytes > 2 * found["gradient"].bytes_without


def test_bytes_are_those_of_the_tensors() -> None:
    """With strain, stress and history of sand a particle takes 9 rows of four numbers instead of 8."""
    studied = _studied("desert")
    pair = next(pair for pair in pairs(studied.scene) if pair.effect is Effect.PLASTICITY)
    on, off = (Solver(scene, studied.fidelity) for scene in (pair.on, pair.off))
    assert state_bytes(on) - state_bytes(off) == 4 * 4 * on.particle_count
    assert tensor_bytes([on.matter.state]) == 4 * 4 * 9 * on.particle_count


def test_timers_are_asked_in_turn() -> None:
    """Once each per round, so that a slow moment of the machine meets all of them; the median is taken."""
    asked: list[str] = []
    readings = {"a": iter([1.0, 9.0, 2.0]), "b": iter([5.0, 4.0, 6.0])}

    def timer(name: str) -> float:
        asked.append(name)
        return next(readings[name])

    assert in_turn([lambda: timer("a"), lambda: timer("b")], 3) == [2.0, 5.0]
    assert asked == ["a", "b"] * 3
