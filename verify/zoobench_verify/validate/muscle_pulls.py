"""The muscles of every animal: the motion that each begins, against the integral of its stress over the body.

A free body obeys d/dt of the sum of m v . u = - the integral of tau : grad u, whatever the test field u. A linear field
is exact on the grid: it shows each muscle's size and the direction of its pull. That of bending is nearly so.
"""

from typing import NamedTuple

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.registry import Kind
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench.spec import Ref
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import WEIGHTLESS

ANIMALS = ("baby-seal", "block", "caterpillar", "clownfish", "fish", "orca", "panda", "shark", "tuna")

_MATERIAL = ElasticMaterial(youngs_modulus=5e4, poissons_ratio=0.3, density=1000.0, muscle_strength=1e4)
_SPACING = 1 / 64
_MARGIN = 6 * _SPACING


class Pulls(NamedTuple):
    """The effect of a body's muscles within one substep from rest, one muscle to a world.

    Attributes:
        virial: rate of change of the sum of m v x^T `[muscles, 3, 3]` [J].
        due: the integral of -tau over the body, which it should be.
        bend: rates of change of the sum of m v . u `[muscles, 2]` [J], u being bending up and to the right.
        bend_due: the integral of -tau : grad u.
        shortening: rate at which the muscle shortens, mean over its volume `[muscles]`, positive as it pulls.
        kept: share of the work of the active stress that the particles have as kinetic energy `[muscles]` [-].
    """

    virial: Array
    due: Array
    bend: Array
    bend_due: Array
    shortening: Array
    kept: Array


def pulls(name: str) -> Pulls:
    """Let every muscle of an animal pull with its full strength, alone and in free flight, for one substep."""
    fidelity = Fidelity(_SPACING, precision=64)
    body: Body = registry.create(Kind.DESIGN, Ref(name)).body(fidelity)
    low = body.positions.min(0) - _MARGIN
    places = body.positions - low
    upper = places.max(0) + _MARGIN
    robot = ElasticBody.placed(_MATERIAL, body, places)
    scene = Scene(robot, (0, 0, 0), (float(upper[0]), float(upper[1]), float(upper[2])), gravity=WEIGHTLESS)
    solver = Solver(scene, fidelity, worlds=body.muscle_count)
    rollout, _ = solver.begin(np.eye(body.muscle_count)[None])
    solver.simulation.set_tension(rollout, 0)
    solver.substeps(1)
    v, C = (tensor[0].numpy().astype(float) for tensor in (solver.matter.v, solver.matter.C))
    return _measured(body, places, v / solver.dt, C / solver.dt, fidelity.moment)


def _measured(body: Body, x: Array, v: Array, C: Array, moment: float) -> Pulls:
    """The integrals, of positions `[n, 3]`, accelerations `[muscles, n, 3]` and rates of C `[muscles, n, 3, 3]`."""
    mass, volume = body.masses(_MATERIAL.density), body.volumes * body.occupancy
    active = _MATERIAL.muscle_strength * volume[:, None] * body.muscle_membership  # [n, muscles]
    due = -np.einsum("pk,pi,pj->kij", active, body.fibres, body.fibres)
    virial = np.einsum("p,kpi,pj->kij", mass, v, x) + moment * np.einsum("p,kpij->kij", mass, C)
    along = np.einsum("pi,kpij,pj->kp", body.fibres, C, body.fibres)
    work = -(active.T * along).sum(1)
    kinetic = np.einsum("p,kp->k", mass, (v**2).sum(2) + moment * (C**2).sum((2, 3)))
    shares = volume[:, None] * body.muscle_membership
    bend, bend_due = [], []
    r = x - (mass @ x) / mass.sum()
    for side in (1, 2):  # u = (-x s, x^2 / 2) in the plane of x and of the coordinate s towards that side
        field, slope = np.zeros_like(r), np.zeros((len(r), 3, 3))
        field[:, 0], field[:, side] = -r[:, 0] * r[:, side], r[:, 0] ** 2 / 2
        slope[:, 0, 0], slope[:, 0, side], slope[:, side, 0] = -r[:, side], -r[:, 0], r[:, 0]
        affine = moment * np.einsum("p,kpij,pij->k", mass, C, slope)  # of the particles' own turning and stretching
        bend.append(np.einsum("p,kpi,pi->k", mass, v, field) + affine)
        pull = np.einsum("pi,pij,pj->p", body.fibres, slope, body.fibres)
        bend_due.append(-np.einsum("pk,p->k", active, pull))
    shortening = -(shares.T * along).sum(1) / shares.sum(0)
    return Pulls(virial, due, np.array(bend).T, np.array(bend_due).T, shortening, kinetic / work)


_SOURCE = "virtual work of the active stress (closed form)"


@case("muscle-pulls-all", _SOURCE, f"all animals at {_SPACING:g} m", args=(ANIMALS,), is_fast=False)
@case("muscle-pulls", _SOURCE, f"block and caterpillar at {_SPACING:g} m", args=(("block", "caterpillar"),))
def muscle_pulls(record: CaseRecorder, animals: tuple[str, ...]) -> None:
    """Every muscle of an animal pulls along its fibres, with its strength, and bends the body to its side."""
    size, bending, kept, pull, computed, due = 0.0, 0.0, [], [], [], []
    for name in animals:
        found = pulls(name)
        scale = np.linalg.norm(found.due, axis=(1, 2))
        size = max(size, float((np.linalg.norm(found.virial - found.due, axis=(1, 2)) / scale).max()))
        largest = np.abs(found.bend_due).max()
        bending = max(bending, float(np.abs(found.bend - found.bend_due).max() / largest))
        computed += (found.bend / largest).ravel().tolist()
        due += (found.bend_due / largest).ravel().tolist()
        kept += found.kept.tolist()
        pull += found.shortening.tolist()
    record.at_most("integral of the active stress of a muscle, relative error", size, 1e-9)
    record.at_most("bending moment of a muscle, error over the animal's largest", bending, 0.1)
    record.holds(f"all {len(pull)} muscles shorten as they pull", min(pull) > 0)
    record.within("least share of a muscle's work that becomes motion in a substep", min(kept), 0.7, 1.0)
    figure = record.plot(
        "Bending by single muscles", "due over the animal's largest [-]", "rate over the largest due [-]"
    )
    figure.computed("MPM", np.array(due), np.array(computed), points=True)
    figure.reference("virtual work", np.array([-1.0, 1.0]), np.array([-1.0, 1.0]))
