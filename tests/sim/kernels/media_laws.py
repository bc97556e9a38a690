"""The laws of the media as functions of arrays, the materials they are tested with and random trial states of each."""

from dataclasses import replace

import numpy as np

from tests.sim import scenes
from tests.sim.kernels.lanes import compiled, symmetric, tensors
from tests.sim.kernels.law_kernels import medium_all, medium_back_all, medium_native, packed, unpacked
from zoobench.sim.launcher import law_of
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.laws.snow import SnowMaterial

Solid = SandMaterial | ClayMaterial | MudMaterial | SnowMaterial
Triple = tuple[np.ndarray, np.ndarray, np.ndarray]

SAND = SandMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1600.0, friction_angle=45.0)
CLAY = ClayMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1800.0, yield_stress=250.0)
MUD = MudMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1400.0, yield_stress=200.0, viscosity=1.0)
SNOW = replace(scenes.SNOW, youngs_modulus=1e4, poissons_ratio=0.3)
SOLIDS: dict[str, Solid] = {"sand": SAND, "clay": CLAY, "mud": MUD, "snow": SNOW}
MU, LAM = SAND.lame


def constants(material: Medium) -> np.ndarray:
    """Those that kernels have."""
    return np.array([getattr(material, name) for name in material.constants])


def update(material: Solid, b: np.ndarray, history: np.ndarray, precision: int = 64) -> Triple:
    """The kernel's elastic b, new history and stress."""
    given = tensors(precision, b, history, 0 * b, 0 * history, 0 * b, constants(material))
    medium_all(*given, law_of(material))
    elastic, after, stress = (t.double().numpy() for t in given[2:5])
    return elastic, after, stress


def twin_update(material: Solid, b: np.ndarray, history: np.ndarray) -> Triple:
    """The NumPy laws' elastic b, new history and stress, from trial b `[..., 3, 3]` and history `[...]`."""
    squares, frame = np.linalg.eigh(b)
    strain = 0.5 * np.log(squares)
    elastic, after = material.returned(strain, history)

    def assemble(values: np.ndarray) -> np.ndarray:
        assembled: np.ndarray = np.einsum("...ij,...j,...kj->...ik", frame, values, frame)
        return assembled

    return assemble(np.exp(2.0 * elastic)), after, assemble(material.stress(elastic, after))


def update_adjoint(
    material: Solid, b: np.ndarray, history: np.ndarray, adjoints: Triple, precision: int = 64
) -> tuple[np.ndarray, np.ndarray]:
    """The kernel's adjoints by b and history, from those of elastic b, new history and stress."""
    given = tensors(precision, b, history, *adjoints, 0 * b, 0 * history, constants(material))
    medium_back_all(*given, law_of(material))
    return given[5].double().numpy(), given[6].double().numpy()


def native(material: Solid, b: np.ndarray, history: np.ndarray, adjoints: Triple) -> list[np.ndarray]:
    """`update` and `update_adjoint` by a kernel that is compiled to the processor's own vectors of four."""
    lanes = [np.zeros((len(b), 2, 4)) for _ in range(5)]
    for array, matrices, numbers in zip(lanes[:2], (b, adjoints[0]), (history, adjoints[1]), strict=False):
        array.reshape(-1, 8)[:, :7] = np.concatenate([packed(matrices), numbers[:, None]], 1)
    lanes[2].reshape(-1, 8)[:, :6] = packed(adjoints[2])
    given = tensors(64, *lanes[:3], lanes[3], lanes[3], lanes[4], constants(material))
    with compiled():
        medium_native(*given, law_of(material))
    elastic, stress, back = (t.numpy().reshape(-1, 8) for t in given[3:6])
    return [unpacked(elastic), elastic[:, 6], unpacked(stress), unpacked(back), back[:, 6]]


def assemble(turns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Symmetric matrices with these eigenvectors (columns) and eigenvalues."""
    return symmetric(np.einsum("...ij,...j,...kj->...ik", turns, values, turns))


def rest_history(material: Solid, count: int) -> np.ndarray:
    """The history of a state at rest."""
    return material.rest_history(np.zeros((count, 3)))


def states(material: Solid, count: int, seed: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Random trial b and history: elastic, yielding and loose, with every kind of past."""
    rng = np.random.default_rng(seed)
    turns = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    if isinstance(material, SandMaterial):
        strain = 0.2 * rng.normal(size=(count, 3)) * rng.uniform(0, 1, (count, 1)) - 0.1 * rng.uniform(0, 1, (count, 1))
        history = np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0, 0.2, count))
    else:
        size = np.exp(rng.uniform(np.log(2e-3), np.log(0.2), (count, 1)))
        strain = size * (rng.normal(size=(count, 3)) - 0.3)
        history = rest_history(material, count)
    if isinstance(material, SnowMaterial):
        history = rng.uniform(0.8, 1.3, count)
    return assemble(turns, np.exp(2 * strain)), history


def states_of_size(material: Solid, count: int, size: float, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Random trial b with |b - I| = size, mostly compressed, and history of every kind."""
    rng = np.random.default_rng(seed)
    E = symmetric(rng.normal(size=(count, 3, 3)))
    E /= np.linalg.norm(E, axis=(1, 2))[:, None, None]
    E -= rng.uniform(0, 1.5, (count, 1, 1)) * np.eye(3)
    E *= size / np.linalg.norm(E, axis=(1, 2))[:, None, None]
    history = rest_history(material, count)
    if isinstance(material, SandMaterial):
        # a surplus of volume, none, or pressure before any strain
        history = size * rng.uniform(-1, 1, count) * rng.choice([0, 1], count)
    elif isinstance(material, SnowMaterial):
        history = rng.uniform(0.8, 1.3, count)
    return np.eye(3) + E, history


def strains(b: np.ndarray) -> np.ndarray:
    """Principal Hencky strains in rising order."""
    logs: np.ndarray = 0.5 * np.log(np.linalg.eigvalsh(b))
    return logs


def deviators(a: np.ndarray) -> np.ndarray:
    """Frobenius norm of the deviators of symmetric matrices."""
    trace = np.trace(a, axis1=1, axis2=2)
    norms: np.ndarray = np.linalg.norm(a - trace[:, None, None] / 3 * np.eye(3), axis=(1, 2))
    return norms
