"""What every registered component owes, whoever wrote it. A new component is tested by being registered."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from tests.conformance.cells import POND, SEA, TANK, cell
from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.firm_ground import usual_task
from zoobench.cell.problem import Problem
from zoobench.cell.task_fault import sense_fault
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.testing import (
    DOUBLE,
    WITH_OBJECT,
    check_body,
    check_cell,
    check_controller,
    check_documentation,
    check_method,
    check_rest,
    check_units,
)

ENVS, TASKS, DESIGNS, CONTROLLERS, METHODS, FIDELITIES = (registry.names(kind) for kind in Kind)
MIXTURE = "mix[movement-speed=1,turning=0.2,final-position=0.1,power=-0.05,sideways=-0.3]"
TASKS = [name if name != "mix" else MIXTURE for name in TASKS]
# what a user's file makes is tested with files, in tests/designs
DESIGNS = [name for name in DESIGNS if not registry.get(Kind.DESIGN, name).required]
# a stored gait is tested with stored runs, in tests/controllers
CONTROLLERS = [name for name in CONTROLLERS if not registry.get(Kind.CONTROLLER, name).required]

# an agent of a user's file is tested with files, in tests/methods
METHODS = [name for name in METHODS if not registry.get(Kind.METHOD, name).required]


SHOWN_ELSEWHERE = ("clay", "snow", "wetland", "shallow-water")
"""Media whose kernels take ten seconds to compile. They are simulated in `tests/envs`; their adjoints are checked in
`tests/sim/kernels/test_media_adjoint.py` and `test_drift.py`, and those of a robot in a bed, of which a part sleeps, in
the desert here."""


ALIKE = (
    "arm", "baby-seal", "panda", "orca", "shark", "clownfish", "tuna",
    "particle", "diff-cppn", "barycenter",
)  # fmt: skip
"""Bodies with other particles in the kernels of one of their kind: of bodies of one piece, of those with a base, of
swimmers, and of spaces of sites, of a network and of animals one is simulated. A new one is, too, until it is here."""


def _is_fast(env: str, task: str, design: str) -> bool:
    """The caterpillar everywhere and in every task, but not all pairs; of other bodies one of each kind, once.

    Bodies move on land, or in the pond below if they belong into water. Of the tasks with an object and of obstacles
    the cells below, and `push-to`, whose objective has much in it. All of the product is for `-m slow`.
    """
    if registry.get(Kind.TASK, task.partition("[")[0]).usual_settings:
        return task == "push-to" and design == "caterpillar" and env == WITH_OBJECT
    if env in SHOWN_ELSEWHERE:
        return False
    if design == "caterpillar":
        return task == "movement-speed" or env == "ground"
    return task == usual_task(Ref(design)) and env == "ground" and design not in (*SWIMMERS, *ALIKE)


def _possible(env: str, task: str, design: str) -> list[str]:
    """The environment for a task, with a box if it needs one, on flat backs if it is carried; none if it has no sense.

    A box is something to climb, too: a slope would have kernels of its own. What is thrown or lifted is in cells below.
    """
    usual = registry.get(Kind.TASK, task.partition("[")[0]).usual_settings
    place = env
    if usual:
        water = "water=grid," * (env == "ocean")
        where = "object_place=back" if task == "carry" and not water else "object_gap=0"
        place = f"{env}[{water}object=box,{where}]"
        if "object" not in registry.get(Kind.ENV, env).parameters or (task == "carry" and design not in FLAT):
            return []
    return [] if sense_fault(Ref.parse(place), Ref.parse(task), Ref(design)) else [place]


FLAT = ("block", "caterpillar")
"""Bodies that keep a box on their backs at smoke."""

BODIES = [name for name in DESIGNS if "space" not in registry.get(Kind.DESIGN, name).tags]
SWIMMERS = [name for name in DESIGNS if "water" in registry.get(Kind.DESIGN, name).tags]
CELLS = [
    pytest.param(place, task, design, marks=() if _is_fast(place, task, design) else pytest.mark.slow)
    for env, task, design in itertools.product(ENVS, TASKS, DESIGNS)
    for place in _possible(env, task, design)
]
CELLS += [
    pytest.param(
        POND,
        "movement-speed",
        name,
        id=f"pond-movement-speed-{name}",
        marks=pytest.mark.slow if name in ALIKE else (),
    )
    for name in (*SWIMMERS, "voxel")  # and a design space in water
]
CELLS.append(pytest.param(SEA, MIXTURE, "fish", id="sea-mix-fish"))
# a ball whose tilt is how far it has rolled, and that slips, too, so that the limit of friction counts
BALL = "ground[object=ball,object_gap=0,object_ground_friction=0.02]"
CELLS.append(pytest.param(BALL, "topple", "caterpillar", id="ball-topple-caterpillar"))
# the robot begins at an obstacle: the walls of a shaft it hardly touches in a few frames
HURDLE = "ground[obstacle=hurdle,obstacle_distance=0]"
CELLS.append(pytest.param(HURDLE, "climb", "caterpillar", id="hurdle-climb-caterpillar"))
# the plank of a cell at smoke begins below the robot, and hangs freely a cell ahead of it
BRIDGE = "ground[obstacle=bridge,obstacle_distance=0,obstacle_length=0.125]"
THROWN = "ground[object=box,object_gap=0.005,object_speed=0.6]"
CELLS += [
    pytest.param(place, task, name, id=f"{word}-{task}-{name}", marks=pytest.mark.slow)
    for word, place, task, names in (
        # gradients through forces on a surface are in tests/sim/test_surface_water.py; the surface of a relaxed body
        # jumps with its shape, and a gradient holds it
        ("sea", SEA, "movement-speed", BODIES),
        ("tank", TANK, "movement-speed", ["caterpillar"]),
        ("thrown", THROWN, "catch", ["caterpillar"]),
        ("hills", "ground[relief=0.01,object=ball,object_gap=0]", "topple", ["caterpillar"]),
        ("bridge", BRIDGE, "movement-speed", ["caterpillar"]),
        ("below", str(cell(task="lift").env), "lift", ["gripper"]),
    )
    for name in names
]
ALL = [(kind, name) for kind in Kind for name in registry.names(kind)]


@pytest.fixture(autouse=True)
def _few_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the barycenter's iterations: their number is fixed, so that what a map owes holds for any."""
    monkeypatch.setattr("zoobench.designs.barycenter._ITERATIONS", 10)


@pytest.fixture
def soon_at_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies are let go after one equilibration: what a cell or a method owes holds for any beginning."""
    monkeypatch.setattr("zoobench.sim.rest.MOST_ROUNDS", 0)


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_it_is_documented_and_has_only_optional_parameters(kind: Kind, name: str) -> None:
    """A first line for `zoobench list`, and defaults for everything but a user's file or run, so that the name runs."""
    check_documentation(kind, name)


@pytest.mark.parametrize("name", ENVS)
def test_an_environment_tells_the_unit_of_every_number(name: str) -> None:
    """Each parameter has a line of its own in what `zoobench show` prints, numbers with a unit in brackets."""
    check_units(name)


@pytest.mark.parametrize("name", FIDELITIES)
def test_a_fidelity_is_what_it_says(name: str) -> None:
    """Every knob can be turned by its name."""
    fidelity = registry.create(Kind.FIDELITY, Ref.parse(f"{name}[precision=64,grid_spacing=0.01,courant=0.3]"))
    assert (fidelity.precision, fidelity.grid_spacing, fidelity.courant) == (64, 0.01, 0.3)


@pytest.mark.parametrize(
    # on the ground they are those with the most particles; tests/designs/test_animals.py has their muscles
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in ("baby-seal", "panda") else ()) for name in DESIGNS],
)
def test_a_body_is_whole(name: str) -> None:
    """It stands on its ground point, muscles are named and used, head and tail exist, mass is that of a finer body."""
    check_body(name)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_controller_is_a_differentiable_map_into_the_range(name: str) -> None:
    """Activity has its shape, stays in [-1, 1], is none for zeros, and every parameter, if any, matters."""
    check_controller(name)


def _last_reward(rewards: Array) -> float:
    return float(rewards[-1])


def _mean_reward(rewards: Array) -> float:
    return float(rewards.mean())


def _highest_reward(rewards: Array) -> float:
    return float(rewards.max())


SCORES: dict[str, Callable[[Array], float] | None] = {
    **{name: _last_reward for name in registry.names(Kind.TASK) if "final" in registry.get(Kind.TASK, name).tags},
    "mix": None,
    "carry": None,
    "catch": None,
    "climb": None,
    "flip": None,
    "jump": _highest_reward,
}
"""How the score follows from the rewards, where it is not their mean: that of a final state is the last, of a peak the
highest."""


@pytest.mark.usefixtures("soon_at_rest")
@pytest.mark.parametrize(("env", "task", "design"), CELLS)
def test_a_cell_is_finite_repeatable_and_differentiable(env: str, task: str, design: str) -> None:
    """Score, metrics with units, rewards and gradients are finite, and a second problem gives the same bits.

    The score is the mean reward, so that it does not grow with the episode, or of a final state the last. Its
    derivative along a random direction agrees with central differences.
    """
    spec = cell(environment=env, task=task, design=design, fidelity=DOUBLE)
    check_cell(spec, SCORES.get(spec.task.name, _mean_reward))


REST_SPEEDS = {"ground": 1e-5, "wetland": 3e-6, "shallow-water": 1e-4, "ocean": 1e-4, POND: 1e-4, TANK: 1e-4}
"""Where a body does not rest to within 1e-6 m/s [m/s]: mud creeps, the water keeps a current of a tenth of a mm/s, and
on the ground a drawn body settles by up to 2e-6 m when it is let go, and rests then."""

BEDS = ("desert", "wetland", "clay", "snow")

DRAWN_ON_A_BED = 2e-5
"""Of a drawn body on a bed [m/s]: parts of little matter go on sinking into the medium, unlike on the left and on the
right. A thousandth of what trained gaits reach."""


def _idles(env: str, design: str) -> bool:
    """Given bodies that stand on the ground and one that is drawn there, the caterpillar on ice.

    `tests/envs/test_rest.py` has every environment at rest.
    """
    stands = design in BODIES and design not in (*ALIKE, "gripper")
    return (env == "ground" and (stands or design == "voxel")) or (env == "ice" and design == "caterpillar")


@pytest.mark.parametrize(
    ("env", "design"),
    [
        *(
            pytest.param(*names, marks=() if _idles(*names) else pytest.mark.slow)
            for names in itertools.product(ENVS, DESIGNS)
        ),
        # in water kernels of this precision would be compiled for these alone
        pytest.param(POND, "voxel", id="pond-voxel", marks=pytest.mark.slow),
        pytest.param(SEA, "fish", id="sea-fish", marks=pytest.mark.slow),
        pytest.param(SEA, "voxel", id="sea-voxel", marks=pytest.mark.slow),
        pytest.param(TANK, "voxel", id="tank-voxel", marks=pytest.mark.slow),
    ],
)
def test_a_body_without_a_mind_stays_where_it_is(env: str, design: str) -> None:
    """With all muscles at rest it moves by less than 1e-6 m/s, drawn bodies too: else its score is not its own.

    On the ground and on beds at the resolution of scores: a bed of one cell carries nobody in peace.

    A body of a design space that was dropped into the state of its full workspace moved by 3e-3 m/s.
    """
    spec = cell(environment=env, design=design, frames=25, fidelity="draft" if env in ("ground", *BEDS) else "smoke")
    is_drawn = "space" in registry.get(Kind.DESIGN, design).tags
    check_rest(spec, DRAWN_ON_A_BED if is_drawn and env in BEDS else REST_SPEEDS.get(env, 1e-6))


@pytest.mark.usefixtures("soon_at_rest")
@pytest.mark.parametrize(
    # those that draw hundreds of bodies or networks take seconds, and have toys in tests/methods
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in ("evolution", "neat", "quality-diversity") else ())
        for name in METHODS
    ],
)
def test_a_method_solves_a_real_cell_within_its_budget(name: str) -> None:
    """Through the real simulator: a solution whose parameters give its score again, interrupted or not."""
    check_method(name)


@pytest.mark.usefixtures("soon_at_rest")
@pytest.mark.parametrize("env", ["ground", pytest.param("ocean", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name != "sine-basis"])
def test_the_gradient_matches_differences_for_every_controller(env: str, name: str) -> None:
    """In double precision, along a random direction; the sine basis is in every cell above."""
    problem = Problem(cell(environment=env, controller=name, fidelity="smoke[precision=64]", frames=6))
    params = problem.initial(np.random.default_rng(1))
    _, gradient = problem.loss_and_grad(params)
    direction = np.random.default_rng(2).normal(size=len(params))
    # a step of 1e-5 reaches, in the ocean, where a frame takes another number of substeps
    ahead, behind = (problem.evaluate(params + sign * 1e-6 * direction).score for sign in (1.0, -1.0))
    assert -gradient @ direction == pytest.approx((ahead - behind) / 2e-6, rel=1e-5, abs=1e-12)
