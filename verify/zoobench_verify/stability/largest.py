"""The largest stable step, found by bisection, compared with the one that the solver predicts from its state.

Each scene is in equilibrium, with a disturbance so small that only linear growth can increase it: a step is stable if
the energy of the disturbance stays below a bound that no stable step reaches. The isolated particle sets the limit, so
its ratio must be 1 where its stiffness is known exactly; particles with neighbours are stable at longer steps.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.laws.snow import SnowMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.state import Matter
from zoobench.sim.solver import Solver
from zoobench_verify.energies import to_array
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.muscles import stretches_at_rest
from zoobench_verify.stability.particle_cases import PLACE, spray_scene

_STEPS = 400
_DISTURBANCE = 1e-7  # of the wave speed, so that 1e4 times its energy is still a small strain
_GROWTH = 1e4  # of the energy; a stable step of 0.995 of the limit lets it grow by 1 / (1 - 0.995^2) = 100
_RANGE = (0.5, 4.0)
_CORNER = (0.4375, 0.4375, 0.4375)
_RESOLUTION = 0.005
SAFE = 0.99
SHARP = 1.01


@dataclass(frozen=True)
class StableStepRow:
    """One scene of the study.

    Attributes:
        particles: of the scene.
        predicted: dt_iso of the state [s].
        measured: largest stable step [s], to half a per cent.
        ratio: measured by predicted.
        verdict: `pass` if the prediction is safe, and for an isolated elastic or clay particle also sharp, to 1 %.
        seconds: wall time [s].
    """

    case: str
    particles: int
    predicted: float
    measured: float
    ratio: float
    verdict: str
    seconds: float


def largest_steps() -> Iterator[StableStepRow]:
    """Every scene in turn."""
    start = time.perf_counter()
    for name, solver, sharp in _scenes():
        state = solver.matter.copy_slot(0)
        predicted = solver.current_limit()[0].dt_iso
        ratio = _bisect(lambda share: _is_stable(solver, state, share * predicted))  # noqa: B023  (used at once)
        verdict = "pass" if ratio >= SAFE and (not sharp or ratio <= SHARP) else "fail"
        seconds = time.perf_counter() - start
        yield StableStepRow(name, solver.particle_count, predicted, ratio * predicted, ratio, verdict, seconds)
        start = time.perf_counter()


def _bisect(is_stable: Callable[[float], bool]) -> float:
    """Largest stable share of the prediction between the ends of the range, from below."""
    low, high = _RANGE
    if not is_stable(low):
        return low
    while high - low > _RESOLUTION * low:
        middle = float(np.sqrt(low * high))
        if is_stable(middle):
            low = middle
        else:
            high = middle
    return low


def _is_stable(solver: Solver, state: Matter, dt: float) -> bool:
    """Whether a small disturbance of the state stays small at this step [s].

    A particle that it throws out of the arena may come to rest there, held by the walls.
    """
    solver.matter.load_slot(0, state)
    rng = np.random.default_rng(12)
    rate = _DISTURBANCE / solver.limit.dt_iso
    for tensor, size in ((solver.matter.v[0], rate * solver.fidelity.grid_spacing), (solver.matter.C[0], rate)):
        tensor += solver.simulation.tensor(size * rng.normal(size=tuple(tensor.shape)))
    first = _motion(solver)
    for _ in range(8):
        solver.substeps(_STEPS // 8, dt)
        moved = float((solver.matter.x[0] - state.x[0]).abs().max())
        if not (_motion(solver) <= _GROWTH * first and moved < solver.fidelity.grid_spacing):
            return False
    return True


def _motion(solver: Solver) -> float:
    """Kinetic energy of the particles and of their affine motion, per mass [m^2/s^2]."""
    spread = solver.fidelity.moment
    return float(np.square(to_array(solver.matter.v[0])).sum() + spread * np.square(to_array(solver.matter.C[0])).sum())


def _scenes() -> Iterator[tuple[str, Solver, bool]]:
    """Name and solver of every scene, and whether it is an isolated particle whose stiffness is predicted exactly."""
    lone, block = np.array([PLACE]), scenes.cube(_CORNER)
    for ratio in (0.0, 0.2, 0.45):
        body = scenes.passive(lone, replace(scenes.RUBBER, poissons_ratio=ratio))
        yield f"lone particle, nu {ratio:g}", scenes.reset_solver(scenes.flight(body, 1.0)), True
    yield "spray", scenes.reset_solver(spray_scene()), False
    for ratio in (0.2, 0.45):
        body = scenes.passive(block, replace(scenes.RUBBER, poissons_ratio=ratio))
        yield f"block, nu {ratio:g}", scenes.reset_solver(scenes.flight(body, 1.0)), False
    # the prediction takes all stretches of a contracted muscle as the largest, those of snow as its largest elastic one
    yield "lone muscle, contracted", _contracted(scenes.passive(lone, scenes.MUSCLE)), False
    yield "block of muscle, contracted", _contracted(scenes.passive(block, scenes.MUSCLE)), False
    yield "caterpillar, contracted", _robot(), False
    for name in ("clay", "snow"):
        yield f"lone particle of {name}", _free_medium(name, 1), name == "clay"
        yield f"block of {name}", _free_medium(name, 4), False
    for name in scenes.MEDIA:
        yield f"box full of {name}", _boxed(name), False


def _contracted(body: ElasticBody) -> Solver:
    """A body in the equilibrium of its muscles at full strength: without stress, and at rest."""
    strength = body.material.muscle_strength
    along, across = stretches_at_rest(strength)
    F = np.diag([along, across, across])
    centre = body.positions.mean(0)
    body = replace(
        body, positions=centre + (body.positions - centre) @ F, muscle_membership=np.ones((body.particle_count, 1))
    )
    solver = scenes.reset_solver(scenes.flight(body, 1.0))
    solver.matter.F[0, 0] = solver.simulation.tensor(F)
    solver.parameters.tension[:] = strength
    return solver


def _robot() -> Solver:
    """The caterpillar in free flight, all of it contracted."""
    body = scenes.caterpillar(scenes.fidelity(64))
    found = scenes.passive(body.positions + 0.5, scenes.MUSCLE)
    return _contracted(replace(found, volumes=body.volumes, fibres=body.fibres))


def _free_medium(name: str, cells: int) -> Solver:
    """A medium with tensile strength, in free flight."""
    per_cell = 1 if cells == 1 else scenes.PER_CELL
    places = scenes.lattice(_CORNER, (cells, cells, cells), per_cell) + 0.0071  # a generic place in the cells
    return scenes.reset_solver(scenes.lone_bed(scenes.bed_of(scenes.medium_material(name), places)))


def _boxed(name: str) -> Solver:
    """A medium compressed by half a per cent in a box that it fills: it exerts pressure on all six walls."""
    material = scenes.medium_material(name)
    side = 4 * scenes.SPACING
    places = scenes.cube(scenes.ORIGIN)
    # snow yields beyond its clamps, and sand shears at the walls: both are equilibrated first
    strain = 0.002 if isinstance(material, SnowMaterial) else 0.005
    bed = scenes.bed_of(material, places, np.full((len(places), 3), -strain))
    body = scenes.bystander((side / 2, side / 2, side / 2))
    scene = Scene(body, scenes.ORIGIN, (side, side, side), medium=bed, ground=Ground(0.0), gravity=scenes.STILL)
    return scenes.reset_solver(scene, start=Solver(scene, scenes.fidelity(64)).equilibrate(60))
