"""What zoobench says of a published gait: design, matter, ground, and the muscles' activity in every frame."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.judge.meshes import Mesh, distance_of, quadratic, tetrahedra
from benchmarks.judge.solver import Element, Matter, Solver, sample_places
from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.db import published
from zoobench.designs.anatomy import Animal
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec


@dataclass(frozen=True)
class Gait:
    """A published gait.

    Attributes:
        name: as `best:ground/movement-speed/panda`.
        design: the animal.
        matter: constants of the body and the ground.
        strength: of muscles [Pa].
        activity: `[frame, muscle]`.
    """

    name: str
    design: Any
    matter: Matter
    strength: float
    activity: Array


def spec_of(name: str, fidelity: str, frames: int = 0) -> tuple[RunSpec, Array]:
    """The run of a published solution in today's environment at a fidelity, and its parameters."""
    best = published.named(name)
    env = registry.resolve(Kind.ENV, Ref.parse(best.spec.env.name))
    level = registry.resolve(Kind.FIDELITY, Ref.parse(fidelity))
    return replace(best.spec, env=env, fidelity=level, frames=frames or best.spec.frames), np.array(best.params)


def gait_of(name: str, frames: int = 0) -> Gait:
    """What a solution does, for so many frames, its own by default."""
    import torch

    spec, params = spec_of(name, "draft", frames)
    problem = Problem(spec, worlds=1)
    times = torch.arange(spec.frames, dtype=torch.float64) * 0.008
    (activity,) = (problem.robot.draft(torch.tensor(params[None]), times).activity,)
    env = registry.create(Kind.ENV, spec.env)
    material, ground = env.robot, env.scene(problem.robot.body, problem.fidelity, 1.0).ground
    assert ground is not None
    matter = Matter(
        material.youngs_modulus, material.poissons_ratio, material.density, material.viscosity,
        gravity=-env.gravity[1], friction=ground.friction,
        thickness=ground.skin.thickness, stiffness=ground.skin.stiffness,
    )  # fmt: skip
    design = registry.create(Kind.DESIGN, spec.design)
    return Gait(name, design, matter, material.muscle_strength, activity.detach().numpy()[:, 0])


def body_of(gait: Gait, cell: float, *, order: int = 2) -> Solver:
    """The animal in tetrahedra, with its tissues averaged over the surroundings of every quadrature point."""
    shape, distance = gait.design.shape, distance_of(gait.design)
    mesh = tetrahedra(distance, np.array(shape.lower), np.array(shape.upper), cell)
    if order == 2:
        mesh = quadratic(mesh, distance)
    return Solver(mesh, gait.matter, **tissues(gait.design, mesh))


def tissues(design: Any, mesh: Mesh, fineness: int = 6) -> dict[str, Array]:
    """Stiffness, density, fibres and muscles of a design at the quadrature points."""
    element, places = Element(mesh.cells.shape[1]), sample_places(fineness)
    # displaced at random: many tetrahedra are mirror images on the very plane between left and right muscles
    drawn = np.random.default_rng(0).dirichlet(np.ones(4), (len(mesh.cells), len(places))) - 0.25
    spread = places + drawn / fineness
    points = np.einsum("esa,eai->esi", element.at(spread), mesh.points[mesh.cells])
    flat = points.reshape(-1, 3)
    near = places @ element.places.T
    share = (near > near.max(axis=1, keepdims=True) - 1e-9).astype(float)  # of each sample, the nearest points'
    share /= share.sum(axis=1, keepdims=True)
    share = (share / share.sum(axis=0)).T  # [point, sample]

    def mean(values: Array) -> Array:
        found: Array = np.einsum("qs,es...->eq...", share, values.reshape(len(points), len(places), *values.shape[1:]))
        return found

    membership = design.membership(flat)
    found = {"membership": mean(membership)}
    if isinstance(design, Animal):
        fibres, muscle = design.fibres(flat), membership.sum(axis=1, keepdims=True) + 1e-6
        lines = mean(fibres * muscle)
        found["fibres"] = lines / np.maximum(np.linalg.norm(lines, axis=-1, keepdims=True), 1e-9)
        found["stiffness"] = mean(design.stiffness(flat))
        dense = design._tissue(flat / design.scale) @ [part.density_ratio for part in design.parts]
        from benchmarks.judge.meshes import volumes

        found["density"] = dense.reshape(len(points), -1).mean(axis=1)
        found["density"] /= np.average(found["density"], weights=np.abs(volumes(mesh.points, mesh.cells)))
    return found
