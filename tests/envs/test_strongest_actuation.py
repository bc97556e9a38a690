"""The strongest actuation: every muscle switched between full contraction and full extension."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from tests.envs.at_rest import ENVS, made, solver_of
from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.mesh import MeshDesign
from zoobench.designs.solid import body_for
from zoobench.designs.space import DesignSpace
from zoobench.inputs import InputFile
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import FRAME_SECONDS, Ref

SWIMMERS = ["fish", "tuna", "shark", "clownfish", "orca"]
BODIES = [name for name in registry.names(Kind.DESIGN) if not registry.get(Kind.DESIGN, name).required]
FRAMES = 200
OMEGA = 80.0  # [rad/s] the fast wave of the sine basis, near the body's own frequency along its length
MARKS = {
    **dict.fromkeys(
        (("barycenter", "ocean"), ("particle", "ocean")),
        pytest.mark.xfail(reason="soft random bodies are flung about in water by forces until they fold", strict=True),
    ),
    **dict.fromkeys((("arm", "ocean"), ("gripper", "ocean")), pytest.mark.skip(reason="it is held, and refused there")),
}
"""By design and environment."""
GOLDEN = (3.0 - np.sqrt(5.0)) / 2.0  # phases that never repeat: no two muscles switch together


def square_waves(muscles: int, in_unison: bool = False) -> NDArray[np.float64]:
    """Square waves of amplitude 1 `[frames, 1, muscles]`, with different phases or in unison."""
    phases = np.zeros(muscles) if in_unison else 2.0 * np.pi * GOLDEN * np.arange(muscles)
    angle = OMEGA * FRAME_SECONDS * np.arange(FRAMES)[:, None] + phases
    return np.where(np.sin(angle) >= 0.0, 1.0, -1.0)[:, None]


def _check(name: str, fidelity: Fidelity, in_unison: bool = False, body: Body | None = None) -> None:
    solver = solver_of(name, fidelity, body)
    rollout = solver.run(square_waves(solver.muscle_count, in_unison))
    assert not rollout.divergences
    assert not rollout.tears
    assert np.isfinite(rollout.positions).all()
    assert rollout.smallest_j[0] > 0.05
    assert not rollout.guarded[0]


# firm ground and water on a grid; beds are at rest in test_rest.py, and each compiles kernels of its own
QUICK = ("ground", "ocean")


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in ENVS])
def test_the_strongest_actuation_is_survived(name: str) -> None:
    """In 200 frames no divergence, no tear, no element near inversion, and no guarded frame."""
    _check(name, Fidelity(1 / 32, precision=64))


@pytest.mark.slow
@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize("spacing", [1 / 32, 1 / 64, 1 / 128])
@pytest.mark.parametrize("name", ENVS)
def test_the_strongest_actuation_is_survived_everywhere(name: str, spacing: float, precision: int) -> None:
    """At three resolutions, in both precisions."""
    _check(name, Fidelity(spacing, precision=64 if precision == 64 else 32))


@pytest.mark.slow
@pytest.mark.parametrize("name", ENVS)
def test_all_muscles_in_unison_do_not_tear_the_robot(name: str) -> None:
    """At the body's own frequency, with full amplitude."""
    _check(name, Fidelity(1 / 64), in_unison=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "design"),
    [
        pytest.param(name, design, marks=MARKS.get((design, name), ()))
        for design, name in itertools.product(BODIES, ENVS)
    ],
)
def test_every_body_survives_the_strongest_actuation(name: str, design: str) -> None:
    """Every animal, and of every design space a body drawn from its prior, at draft."""
    fidelity = made(name).simulated(Fidelity(1 / 64))
    space = registry.create(Kind.DESIGN, Ref(design))
    body = space.body(fidelity)
    if isinstance(space, DesignSpace):
        body = body_for(space, space.initial(np.random.default_rng(5), body), body)
    _check(name, fidelity, body=body)


@pytest.mark.slow
@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize("level", ["draft", "standard", "paper"])
@pytest.mark.parametrize("swimmer", SWIMMERS)
def test_every_swimmer_survives_the_strongest_actuation(swimmer: str, level: str, precision: int) -> None:
    """In the ocean, at the three levels where scores are made, in both precisions."""
    fidelity = made("ocean").simulated(registry.create(Kind.FIDELITY, Ref.parse(f"{level}[precision={precision}]")))
    _check("ocean", fidelity, body=registry.create(Kind.DESIGN, Ref(swimmer)).body(fidelity))


@pytest.mark.slow
@pytest.mark.parametrize("name", ENVS)
def test_an_imported_mesh_survives_the_strongest_actuation(name: str, tmp_path: Path) -> None:
    """An ellipsoid from a file, with the muscles that it is given by its import."""
    shape = trimesh.creation.icosphere(subdivisions=3)
    shape.apply_scale((0.06, 0.03, 0.03))
    file = tmp_path / "ellipsoid.stl"
    shape.export(file)
    fidelity = made(name).simulated(Fidelity(1 / 64))
    _check(name, fidelity, body=MeshDesign(path=InputFile(str(file))).body(fidelity))
