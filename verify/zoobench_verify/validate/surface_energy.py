"""A fish with its own muscles, in water by forces on its surface: where its work and the water's impulse go."""

from dataclasses import dataclass, replace

import numpy as np
import torch

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.muscle_places import muscle_places
from zoobench.controllers.travelling_wave import TravellingWave
from zoobench.designs.base import Design
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.kernels.layout import V, X
from zoobench.sim.model.rest_cells import RestCells
from zoobench.sim.solver import Solver
from zoobench.spec import FRAME_SECONDS, Ref
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.surface_reference import BodyForces, PanelForces, Wet

_FREQUENCY, _FRAMES = 8.0, 32
"""Of the beat [Hz], and length of the episode: two periods."""

_LEVELS = ("draft", "standard", "paper")


@dataclass
class Account:
    """What has been done so far [J], and the impulse of the water [kg m/s].

    Attributes:
        muscles: work of the muscles.
        viscous: loss within the body.
        drag, lift, friction: work on the water by these forces.
        reaction: the same by the added mass's forces.
        impulse: `[3]`.
        straining: sum of the impulse's size over the steps.
    """

    muscles: float = 0.0
    viscous: float = 0.0
    drag: float = 0.0
    lift: float = 0.0
    friction: float = 0.0
    reaction: float = 0.0
    impulse: Array = 0.0  # type: ignore[assignment]
    straining: float = 0.0


@dataclass(frozen=True)
class Stored:
    """What the body and the water about it hold at one moment: energies [J], and the body's momentum [kg m/s]."""

    kinetic: float
    added: float
    elastic: float
    momentum: Array


class Audit:
    """A fish that is followed substep by substep."""

    def __init__(self, level: str) -> None:
        env: Environment = registry.create(Kind.ENV, Ref.parse("ocean"))
        fidelity = replace(env.simulated(registry.create(Kind.FIDELITY, Ref(level))), precision=64)
        design: Design = registry.create(Kind.DESIGN, Ref("fish"))
        body = design.body(fidelity)
        wave = TravellingWave(frequency=_FREQUENCY, wavelength=1.0).placed(muscle_places(body))
        times = torch.arange(_FRAMES, dtype=torch.float64) * FRAME_SECONDS
        parameters = torch.tensor([[0.0, 0.0, 2.0, 0.0]], dtype=torch.float64)
        growing = torch.clamp(times * _FREQUENCY, max=1.0)[:, None, None]
        self._activity = (growing * wave.actuation(parameters, times, body.muscle_count)).numpy()
        scene = env.scene(body, fidelity)
        self._solver = Solver(scene, fidelity, frame_seconds=FRAME_SECONDS)
        cells, given = RestCells.of(scene.robot, fidelity), self._solver.parameters
        self._water = PanelForces(scene, fidelity, cells)
        self._body = BodyForces(
            scene, cells,
            *(tensor[0].double().numpy() for tensor in (given.mass, given.volume, given.stiffness, given.fibre)),
        )  # fmt: skip

    def follow(self) -> tuple[Account, list[Stored]]:
        """The account at the end, and what is held after each frame."""
        rollout = self._solver.run(self._activity)
        self._solver.reset()
        account, held = Account(), [self._stored()]
        for frame, count in enumerate(rollout.counts[:, 0].tolist()):
            self._solver.simulation.set_tension(rollout, frame)
            for _ in range(count):
                self._step(account, FRAME_SECONDS / count)
            held.append(self._stored())
        return account, held

    def _state(self) -> tuple[Array, Array]:
        rows = self._solver.matter.nodes[0, 0].double().numpy()
        return rows[:, X, :3] + self._solver.origin, rows[:, V, :3].copy()

    def _stored(self) -> Stored:
        x, v = self._state()
        mass, added = self._body.node_masses, self._water.at(x, v).added
        return Stored(
            0.5 * float(mass @ (v * v).sum(axis=1)), 0.5 * float(np.einsum("na,nab,nb->", v, added, v)),
            self._body.elastic_energy(x), mass @ v,
        )  # fmt: skip

    def _step(self, account: Account, dt: float) -> None:
        """A substep of `dt` [s], and what is done in it."""
        x, v = self._state()
        wet, tension = self._water.at(x, v), self._solver.parameters.tension[0].double().numpy()
        self._solver.substeps(1, dt)
        _, new = self._state()
        mean, gain = 0.5 * (v + new), new - v
        _, viscous, muscles = self._body.powers(x, v, mean, tension)
        account.muscles += dt * muscles
        account.viscous -= dt * viscous
        account.drag -= dt * float((wet.drag * mean).sum())
        account.lift -= dt * float((wet.lift * mean).sum())
        account.friction -= dt * float((wet.friction * mean).sum())
        inertia = -np.einsum("nab,nb->na", wet.added, gain)
        implicit = -dt * np.einsum("nab,nb->na", wet.resistance, gain)
        account.reaction -= float(((dt * wet.reaction + inertia) * mean).sum())
        account.drag -= float((implicit * mean).sum())
        pushed = dt * _sum(wet) + inertia + implicit
        account.impulse = account.impulse + pushed.sum(axis=0)
        account.straining += float(np.linalg.norm(pushed.sum(axis=0)))


def _sum(wet: Wet) -> Array:
    """All forces but those on accelerations."""
    return wet.drag + wet.lift + wet.friction + wet.reaction


@case("work-on-water", "conservation of energy and of momentum", "draft, standard, paper", is_fast=False)
def work_on_water(record: CaseRecorder) -> None:
    """What the muscles put in is held by body and water, lost within the body or taken by the water.

    The water's forces are computed anew. What the added mass takes beyond its own kinetic energy stays in the wake.
    """
    figure = record.plot("Energy of a fish that begins to swim", "time [s]", "energy [mJ]")
    for level in _LEVELS:
        account, held = Audit(level).follow()
        first, last = held[0], held[-1]
        taken = account.drag + account.lift + account.friction + account.reaction
        stored = last.kinetic + last.elastic - first.kinetic - first.elastic
        off = account.muscles - account.viscous - taken - stored
        record.within(f"energy that is not accounted for, by the muscles' work, at {level}", off / account.muscles,
                      -0.005, 0.005)  # fmt: skip
        gained = last.momentum - first.momentum
        record.at_most(
            f"momentum gained less the water's impulse, by that in all, at {level}",
            np.linalg.norm(gained - account.impulse) / account.straining, 1e-6,
        )  # fmt: skip
        wake = account.reaction - (last.added - first.added)
        record.within(f"left in the wake by the reaction, by the muscles' work, at {level}", wake / account.muscles,
                      0.0, 1.0)  # fmt: skip
        shares = ", ".join(
            f"{name} {value / account.muscles:.2f}"
            for name, value in (("drag", account.drag), ("lift", account.lift), ("friction", account.friction),
                                ("wake", wake), ("viscous", account.viscous), ("held", stored + last.added))
        )  # fmt: skip
        record.remark(f"{level}: muscles {1e3 * account.muscles:.3g} mJ, of which {shares}")
        times = np.arange(len(held)) * FRAME_SECONDS
        figure.computed(f"kinetic, {level}", times, 1e3 * np.array([each.kinetic + each.added for each in held]))
