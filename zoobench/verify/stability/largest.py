"""The largest stable step, found by bisection, beside the one that the solver predicts from the state it is in.

Each scene rests in an equilibrium and is disturbed so little that only linear growth can take it away: a step is stable
if the energy of the disturbance stays below a bound that no stable step reaches. The isolated particle sets the limit,
so its ratio must be 1 where its stiffness is known exactly; whatever has neighbours bears more.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.registry import Kind
from zoobench.sim.model.matter import ElasticMaterial, Law
from zoobench.sim.model.scene import ElasticBody, Ground, Scene
from zoobench.spec import Ref
from zoobench.verify.energies import to_array
from zoobench.verify.stability import scenes
from zoobench.verify.stability.muscles import stretches_at_rest
from zoobench.verify.stability.particle_cases import spray_scene

if TYPE_CHECKING:
    from zoobench.sim.model.state import Matter
    from zoobench.sim.solver import Solver


_STEPS = 400
_DISTURBANCE = 1e-7  # of the wave speed, so that 1e4 times its energy is still a small strain
_GROWTH = 1e4  # of the energy; a stable step of 0.995 of the limit lets it grow by 1 / (1 - 0.995^2) = 100
_RANGE = (0.5, 4.0)
_RESOLUTION = 0.005
SAFE = 0.99
SHARP = 1.01


@dataclass(frozen=True)
class StepRow:
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

    @property
    def passed(self) -> bool:
        """Whether the prediction is what it must be."""
        return self.verdict == "pass"


@dataclass(frozen=True)
class _Subject:
    name: str
    build: Callable[[], "Solver"]
    sharp: bool = False  # an isolated particle whose stiffness is predicted exactly


def largest_steps() -> Iterator[StepRow]:
    """Every scene, one row as it is done."""
    import time

    for subject in _subjects():
        start = time.perf_counter()
        solver = subject.build()
        state = solver.matter.copy_slot(0)
        predicted = solver.current_limit()[0].dt_iso
        ratio = _bisect(lambda share: _is_stable(solver, state, share * predicted))  # noqa: B023  (used at once)
        good = ratio >= SAFE and (not subject.sharp or ratio <= SHARP)
        yield StepRow(
            subject.name,
            solver.particle_count,
            predicted,
            ratio * predicted,
            ratio,
            "pass" if good else "fail",
            time.perf_counter() - start,
        )


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


def _is_stable(solver: "Solver", state: "Matter", dt: float) -> bool:
    """Whether a small disturbance of the state stays small at this step [s]."""
    solver.matter.load_slot(0, state)
    rng = np.random.default_rng(12)
    rate = _DISTURBANCE / solver.limit.dt_iso
    for tensor, size in ((solver.matter.v[0], rate * solver.fidelity.grid_spacing), (solver.matter.C[0], rate)):
        tensor += solver.simulation.tensor(size * rng.normal(size=tuple(tensor.shape)))
    first = _motion(solver)
    for _ in range(8):
        solver.substeps(_STEPS // 8, dt)
        if not _motion(solver) <= _GROWTH * first:
            return False
    return True


def _motion(solver: "Solver") -> float:
    """Kinetic energy of the particles and of their affine motion, per mass [m^2/s^2]."""
    spread = solver.fidelity.moment
    return float(np.square(to_array(solver.matter.v[0])).sum() + spread * np.square(to_array(solver.matter.C[0])).sum())


def _subjects() -> Iterator[_Subject]:
    for ratio in (0.0, 0.2, 0.45):
        material = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=ratio, density=1000.0)
        yield _Subject(f"lone particle, nu {ratio:g}", partial(_elastic, _lone(material)), sharp=True)
    yield _Subject("spray", partial(_elastic, spray_scene().robot, 1.35))
    for ratio in (0.2, 0.45):
        material = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=ratio, density=1000.0)
        yield _Subject(f"block, nu {ratio:g}", partial(_elastic, _block(material)))
    # a contracted muscle is predicted as if all stretches were the largest, snow at its largest elastic stretch
    yield _Subject("lone muscle, contracted", partial(_contracted, _lone(scenes.MUSCLE)))
    yield _Subject("block of muscle, contracted", partial(_contracted, _block(scenes.MUSCLE)))
    yield _Subject("caterpillar, contracted", _robot)
    for name in ("clay", "snow"):
        yield _Subject(f"lone particle of {name}", partial(_free_medium, name, 1), sharp=name == "clay")
        yield _Subject(f"block of {name}", partial(_free_medium, name, 4))
    for name in scenes.medium_names():
        yield _Subject(f"box full of {name}", partial(_boxed, name))


def _lone(material: ElasticMaterial) -> ElasticBody:
    return scenes.passive(np.array([[0.513, 0.497, 0.521]]), material)


def _block(material: ElasticMaterial) -> ElasticBody:
    return scenes.passive(scenes.lattice((0.4375, 0.4375, 0.4375), (4, 4, 4)), material)


def _elastic(body: ElasticBody, size: float = 1.0) -> "Solver":
    from zoobench.sim.solver import Solver

    solver = Solver(scenes.flight(body, size), scenes.fidelity(64))
    solver.reset()
    return solver


def _contracted(body: ElasticBody) -> "Solver":
    """A body that its muscles hold contracted at full strength: without stress, and at rest."""
    from zoobench.sim.solver import Solver

    strength = body.material.muscle_strength
    along, across = stretches_at_rest(strength)
    F = np.diag([along, across, across])
    centre = body.positions.mean(0)
    body = replace(
        body,
        positions=centre + (body.positions - centre) @ F,
        muscle_membership=np.ones((body.particle_count, 1)),
    )
    solver = Solver(scenes.flight(body, 1.0), scenes.fidelity(64))
    solver.reset()
    solver.matter.F[0, 0] = solver.simulation.tensor(F)
    solver.parameters.tension[:] = strength
    return solver


def _robot() -> "Solver":
    """The caterpillar in free flight, all of it contracted."""
    body = registry.create(Kind.DESIGN, Ref("caterpillar")).body(scenes.fidelity(64))
    found = scenes.passive(body.positions + 0.5, scenes.MUSCLE)
    return _contracted(replace(found, volumes=body.volumes, fibres=body.fibres))


def _free_medium(name: str, cells: int) -> "Solver":
    """A medium that resists tension, in free flight."""
    from zoobench.sim.solver import Solver

    per_cell = 1 if cells == 1 else scenes.PER_CELL
    places = scenes.lattice((0.4375, 0.4375, 0.4375), (cells, cells, cells), per_cell) + 0.0071  # no special place
    bed = scenes.bed_of(scenes.medium_material(name), places)
    solver = Solver(
        Scene(scenes.bystander((0.1, 0.1, 0.1)), scenes.ORIGIN, (1.0, 1.0, 1.0), medium=bed, gravity=scenes.STILL),
        scenes.fidelity(64),
    )
    solver.reset()
    return solver


def _boxed(name: str) -> "Solver":
    """A medium pressed by half a per cent into a box that it fills: it pushes on all six walls."""
    from zoobench.sim.solver import Solver

    material = scenes.medium_material(name)
    cells = 4
    side = cells * scenes.SPACING
    places = scenes.lattice(scenes.ORIGIN, (cells, cells, cells))
    # snow yields beyond its clamps, and sand shears at the walls: both come to rest first
    strain = 0.002 if material.law is Law.SNOW else 0.005
    bed = scenes.bed_of(material, places, np.full((len(places), 3), -strain))
    body = scenes.bystander((side / 2, side / 2, side / 2))
    scene = Scene(body, scenes.ORIGIN, (side, side, side), medium=bed, ground=Ground(0.0), gravity=scenes.STILL)
    start = Solver(scene, scenes.fidelity(64)).equilibrate(60)
    solver = Solver(scene, scenes.fidelity(64), start=start)
    solver.reset()
    return solver
