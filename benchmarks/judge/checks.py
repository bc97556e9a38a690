"""The judge against closed forms: `python -m benchmarks.judge.checks`; a minute. It ends with 1 if a check fails."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from benchmarks.judge.meshes import Mesh, quadratic, tetrahedra
from benchmarks.judge.solver import Matter, Solver
from zoobench.arrays import Array

MATTER = Matter(youngs_modulus=1e4, poissons_ratio=0.2, density=1e3, viscosity=20.0)
FLYING = replace(MATTER, gravity=0.0, stiffness=0.0)


class Check(NamedTuple):
    """A figure and what it should be; `tolerance` is relative, or absolute where that is 0."""

    name: str
    found: float
    exact: float
    tolerance: float

    @property
    def holds(self) -> bool:
        """Whether they agree."""
        return abs(self.found - self.exact) <= self.tolerance * (abs(self.exact) or 1.0)


def block(size: tuple[float, float, float], counts: tuple[int, int, int], bend: float = 0.0, order: int = 2) -> Mesh:
    """A block over the ground, of tetrahedra whose inner corners are displaced at random by a share of an edge."""
    from skfem import MeshTet

    lines = [np.linspace(0.0, edge, count + 1) for edge, count in zip(size, counts, strict=True)]
    made = MeshTet.init_tensor(*lines)
    points, cells = made.p.T.copy(), made.t.T.astype(np.int64)
    inner = ((points > 1e-9) & (points < np.array(size) - 1e-9)).all(axis=1)
    apart = np.random.default_rng(0).uniform(-bend, bend, points.shape) * np.array(size) / counts
    points[inner] += apart[inner]
    corners = points[cells]
    turned = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    mesh = Mesh(points, cells)
    return quadratic(mesh) if order == 2 else mesh


def muscle() -> Iterator[Check]:
    """A free block whose fibres pull: all stretches are those of the law, on a distorted mesh and on one cut off."""
    from scipy.optimize import fsolve

    tension, (mu, lam) = 1500.0, MATTER.lame

    def balance(stretch: Array) -> list[float]:
        along, across = stretch
        volumetric = lam * np.log(along * across**2)
        return [mu * (along**2 - 1) + volumetric + tension * along**2, mu * (across**2 - 1) + volumetric]

    along, across = fsolve(balance, [0.9, 1.0])
    ball = tetrahedra(
        lambda x: np.linalg.norm(x - (0.0, 0.02, 0.0), axis=1) - 0.03, np.full(3, -0.03), np.full(3, 0.05), 0.012
    )
    meshes = {
        "distorted, linear": block((0.04, 0.03, 0.02), (4, 3, 2), 0.2, 1),
        "distorted, quadratic": block((0.04, 0.03, 0.02), (4, 3, 2), 0.2),
        "a ball cut by the lattice": quadratic(ball),
    }
    for name, mesh in meshes.items():
        body = Solver(mesh, FLYING, membership=np.ones((len(mesh.cells), 1 if mesh.cells.shape[1] == 4 else 4, 1)))
        body.pull(np.array([tension]))
        body.settle(60, 0)
        F = body.gradients(body.x)
        R = np.linalg.svd(F)[1]
        yield Check(f"muscle, {name}: least stretch", float(R[..., 2].min()), float(along), 1e-4)
        yield Check(f"muscle, {name}: largest stretch", float(R[..., 0].max()), float(across), 1e-4)


def bilayer() -> Iterator[Check]:
    """A free strip whose upper half contracts a little: curvature 1.5 T / (E t) in the middle."""
    tension, thick = 20.0, 0.02
    for order, counts, tolerance in ((2, (16, 4, 3), 0.01), (1, (48, 12, 8), 0.06)):
        mesh = block((6 * thick, thick, 0.75 * thick), counts, order=order)
        element = Solver(mesh, FLYING).element
        places = np.einsum("qa,eai->eqi", element.values, mesh.points[mesh.cells])
        body = Solver(mesh, FLYING, membership=(places[..., 1:2] > thick / 2).astype(float))
        body.pull(np.array([tension]))
        body.settle(150, 0)
        moved = body.x - mesh.points
        part = (np.abs(mesh.points[:, 0] - 3 * thick) < 1.5 * thick) & (np.abs(mesh.points[:, 1] - thick / 2) < 1e-9)
        curvature = 2.0 * np.polyfit(body.x[part, 0], moved[part, 1], 2)[0]
        yield Check(
            f"bilayer, order {order}: curvature by 1.5 T / (E t)",
            abs(curvature) * 1e4 * thick / (1.5 * tension),
            1.0,
            tolerance,
        )


def cantilever() -> Iterator[Check]:
    """A clamped bar under its own weight: the sag of its end by Timoshenko's beam."""
    thick, g = 0.02, 0.04
    length = 8 * thick
    for order, counts, tolerance in ((2, (16, 3, 3), 0.02), (1, (64, 8, 8), 0.08)):
        body = Solver(block((length, thick, thick), counts, order=order), replace(FLYING, gravity=g))
        body.mass[body.mesh.points[:, 0] < 1e-9] = 1e9  # what is clamped
        body.settle(250, 0)
        end = body.mesh.points[:, 0] > length - 1e-9
        sag = float((body.mesh.points[end, 1] - body.x[end, 1]).mean())
        load, E, shear = 1e3 * g, MATTER.youngs_modulus, MATTER.lame[0]
        exact = 1.5 * load * length**4 / (E * thick**2) + load * length**2 / (2 * 0.85 * shear)
        yield Check(f"cantilever, order {order}: sag by Timoshenko's", sag / exact, 1.0, tolerance)


def vibration() -> Iterator[Check]:
    """A free bar that swings along itself: the period is twice its length by sqrt(E / rho)."""
    length, thick = 0.16, 0.02
    body = Solver(block((length, thick, thick), (16, 2, 2)), replace(FLYING, viscosity=0.0))
    shape = np.cos(np.pi * body.mesh.points[:, 0] / length)
    body.v[:, 0] = 0.01 * shape
    seconds, step, before = 0.0, 2e-4, 1.0
    while (now := float((body.mass * shape) @ body.v[:, 0])) > 0.0:
        body.advance(step, 0.5)
        seconds, before = seconds + step, now
    exact = 0.5 * length / np.sqrt(MATTER.youngs_modulus / MATTER.density)
    yield Check("bar: a quarter of its period [ms]", 1e3 * (seconds + step * now / (before - now)), 1e3 * exact, 0.01)


def slope() -> Iterator[Check]:
    """A block on a slope of 20 degrees: g (sin - mu cos), and none where mu > tan."""
    for friction in (0.1, 0.3, 0.5):
        angle = np.radians(20.0)
        body = Solver(block((0.05, 0.02, 0.05), (4, 2, 4)), replace(MATTER, friction=friction))
        body.stand()
        body.settle(30, 0)
        body.matter = replace(body.matter, slope=angle)
        for _ in range(10):  # until it has sheared
            body.advance(0.008)
        before = body.mean(body.v)[0]
        for _ in range(25):
            body.advance(0.008)
        exact = 9.81 * max(np.sin(angle) - friction * np.cos(angle), 0.0)
        yield Check(
            f"slope of 20 degrees, friction {friction}: acceleration [m/s^2]",
            float(body.mean(body.v)[0] - before) / 0.2,
            float(exact),
            0.01,
        )


def flight() -> Iterator[Check]:
    """A block that spins and swings without viscosity: energy, momentum and its moment are kept."""
    mesh = block((0.04, 0.03, 0.02), (4, 3, 2), 0.2)
    body = Solver(mesh, replace(FLYING, viscosity=0.0))
    body.x[:, 1] += 0.1
    r = body.x - body.mass @ body.x / body.mass.sum()
    body.v[:] = np.cross([3.0, 5.0, 8.0], r) + np.array([0.3, 0.2, 0.1]) - 3.0 * r * (1.0, 0.0, 0.0)
    began = state(body)
    for _ in range(40):
        body.advance(0.005, 0.25)
    for name, before, after, tolerance in zip(
        ("energy", "momentum", "moment of momentum"), began, state(body), (2e-3, 1e-9, 1e-3), strict=True
    ):
        yield Check(f"flight: {name} by its first", after / before, 1.0, tolerance)


def damped() -> Iterator[Check]:
    """A block that swings with viscosity: the energy lost is what the stress 2 eta D takes."""
    body = Solver(block((0.04, 0.03, 0.02), (4, 3, 2), 0.2), FLYING)
    r = body.x - body.mass @ body.x / body.mass.sum()
    body.v[:] = -3.0 * r * (1.0, -0.5, 0.3) + np.roll(r, 1, axis=1)
    first, taken = state(body)[0], 0.0

    def power() -> float:
        rate = body.gradients(body.v) @ np.linalg.inv(body.gradients(body.x))
        return float(
            MATTER.viscosity * (body.weights * ((rate + np.swapaxes(rate, 2, 3)) ** 2).sum(axis=(2, 3))).sum() / 2.0
        )

    for _ in range(60):
        before = power()
        body.advance(2e-4, 0.5)
        taken += 1e-4 * (before + power())
    yield Check("viscosity: energy lost by what it takes", (first - state(body)[0]) / taken, 1.0, 0.01)


def tissues() -> Iterator[Check]:
    """Mass, centre and muscles of the animals: those of zoobench's particles at `fine`."""
    from benchmarks.judge.scene import body_of, gait_of
    from zoobench import registry
    from zoobench.registry import Kind
    from zoobench.spec import Ref

    fine = registry.create(Kind.FIDELITY, registry.resolve(Kind.FIDELITY, Ref("fine")))
    # the lattice cuts sharp edges off: those of flippers and fins
    for animal, rough in (("caterpillar", 1.0), ("panda", 1.0), ("baby-seal", 5.0), ("fish", 5.0)):
        gait = gait_of(f"best:ground/movement-speed/{animal}", 1)
        made, theirs = body_of(gait, 0.006), gait.design.body(fine)
        masses = theirs.masses(gait.matter.density)
        yield Check(
            f"{animal}: mass [kg]", float(made.weight.sum() / gait.matter.gravity), float(masses.sum()), 0.005 * rough
        )
        apart = made.weight @ made.mesh.points / made.weight.sum() - masses @ theirs.positions / masses.sum()
        yield Check(
            f"{animal}: distance of the centres of mass [mm]", float(1e3 * np.linalg.norm(apart)), 0.0, 0.2 * rough
        )
        shares, there = made.weights[..., None] * made.membership, theirs.volumes[:, None] * theirs.muscle_membership
        volume, exact = shares.sum(axis=(0, 1))[:, None], there.sum(axis=0)[:, None]
        error = float(np.abs(volume / exact - 1.0).max())
        yield Check(f"{animal}: largest error of a muscle's volume", error, 0.0, 0.025 * rough)
        for noun, mine, other, scale, most in (
            ("centre [mm]", made.quadrature_places(), theirs.positions, 1e3, 0.2),
            ("mean fibre", made.fibres, theirs.fibres, 1.0, 0.01),
        ):
            difference = np.einsum("eqm,eqi->mi", shares, mine) / volume - there.T @ other / exact
            largest = float(scale * np.linalg.norm(difference, axis=1).max())
            yield Check(f"{animal}: largest difference of a muscle's {noun}", largest, 0.0, most * rough)


def state(body: Solver) -> tuple[float, float, float]:
    """Kinetic and elastic energy, momentum, and moment of momentum about the origin."""
    F, (mu, lam) = body.gradients(body.x), body.matter.lame
    log_j = np.log(np.linalg.det(F))
    elastic = (body.weights * (0.5 * mu * ((F**2).sum(axis=(2, 3)) - 3.0) - mu * log_j + 0.5 * lam * log_j**2)).sum()
    moment = (body.mass[:, None] * np.cross(body.x, body.v)).sum(axis=0)
    return body.kinetic() + float(elastic), float(np.linalg.norm(body.mass @ body.v)), float(np.linalg.norm(moment))


def bounce() -> Iterator[Check]:
    """A block dropped on the ground without friction or viscosity: the layer gives back what it took."""
    body = Solver(block((0.03, 0.03, 0.03), (3, 3, 3)), replace(MATTER, viscosity=0.0, friction=0.0))
    body.x[:, 1] += 0.01
    height = float(body.weight @ body.x[:, 1])
    before = state(body)[0] + height
    for _ in range(40):
        body.advance(0.002, 0.25)
    layer = sampled_energy(body)
    yield Check(
        "bounce: energy by its first", (state(body)[0] + float(body.weight @ body.x[:, 1]) + layer) / before, 1.0, 0.003
    )


def sampled_energy(body: Solver) -> float:
    """Energy of the ground's layer by many points [J]."""
    places, m = np.random.default_rng(2).dirichlet(np.ones(4), 2_000), body.matter
    heights = np.einsum("sa,ea->es", places, body.x[body._arrays["piece"], 1])
    density = 0.5 * m.stiffness / m.thickness**2 * np.maximum(m.thickness - heights, 0.0) ** 2
    return float((density.mean(axis=1) * body._arrays["piece_volume"]).sum())


def layer() -> Iterator[Check]:
    """The layer's force on random tetrahedra by many points, and the depth at which a block stands on it."""
    rng = np.random.default_rng(1)
    places = rng.dirichlet(np.ones(4), 200_000)
    worst = 0.0
    for _ in range(60):
        points = rng.uniform(0.0, 0.008, (4, 3))
        cells = np.array([[0, 1, 2, 3]])
        if np.linalg.det(points[1:] - points[0]) < 0.0:
            cells = cells[:, [0, 2, 1, 3]]
        if abs(np.linalg.det(points[1:] - points[0])) < 1e-8:
            continue
        body = Solver(Mesh(points, cells), MATTER)
        total = body.carried()
        depth = np.maximum(MATTER.thickness - places @ body.x[cells[0], 1], 0.0)
        rate = MATTER.stiffness / MATTER.thickness**2 * body.volumes[0]
        exact = np.zeros(4)
        exact[cells[0]] = rate * (depth[:, None] * places).mean(axis=0)
        scale = max(total, 0.02 * rate * MATTER.thickness)
        worst = max(worst, float(np.abs(body.push - exact).max()) / scale)
    yield Check("layer: largest difference of a node's force from a sum over points", worst, 0.0, 1e-2)
    body = Solver(block((0.03, 0.03, 0.03), (3, 6, 3)), replace(MATTER, youngs_modulus=1e6))
    body.stand()
    exact_depth = MATTER.thickness * np.sqrt(2.0 * 1e3 * 9.81 * 0.03 / MATTER.stiffness)
    yield Check(
        "layer: depth of a block that stands on it [mm]",
        1e3 * (MATTER.thickness - float(body.x[:, 1].min())),
        1e3 * exact_depth,
        1e-3,
    )


CHECKS: tuple[Callable[[], Iterator[Check]], ...] = (
    muscle,
    bilayer,
    cantilever,
    vibration,
    slope,
    flight,
    damped,
    bounce,
    layer,
    tissues,
)


def main(chosen: Any = None) -> int:
    """Print every check; returns how many fail."""
    failed = 0
    for each in CHECKS:
        if chosen and each.__name__ not in chosen:
            continue
        for check in each():
            failed += not check.holds
            print(
                f"{'ok  ' if check.holds else 'FAIL'} {check.name}: {check.found:.6g}, exact {check.exact:.6g}",
                flush=True,
            )
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) > 0)
