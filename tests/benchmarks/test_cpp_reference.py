"""The C++ reference: it simulates what the solver does, and says so where it cannot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import cpp_reference
from benchmarks.cpp_reference import Cube, NoReferenceError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver

SUBSTEPS = 40  # of a control frame at the cube's step
CUBE = Cube(edge=6, cells=10, height=0.1, gravity=-200.0)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The compiled program; without a compiler the tests that need it are skipped."""
    try:
        cpp_reference.find_compiler()
    except NoReferenceError as error:
        pytest.skip(str(error))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ZOOBENCH_CACHE", str(tmp_path_factory.mktemp("cache")))
        return cpp_reference.build()


def simulated(cube: Cube) -> np.ndarray:
    """The cube's positions after `SUBSTEPS` of the project's own solver."""
    material = ElasticMaterial(cube.youngs_modulus, cube.poissons_ratio, cube.density)
    volumes = np.full(cube.particle_count, cube.particle_volume)
    body = ElasticBody.passive(material, cube.positions(), volumes)
    edge = cube.cells * cube.spacing
    scene = Scene(body, (0.0, 0.0, 0.0), (edge, edge, edge), gravity=(0.0, cube.gravity, 0.0))
    rollout = Solver(scene, Fidelity(cube.spacing, step=cube.dt, transfer="apic")).run(np.zeros((1, 1, 0)))
    assert rollout.substeps == SUBSTEPS
    return rollout.positions[-1, 0]


def test_the_reference_simulates_what_the_solver_does(program: Path) -> None:
    """A cube that is squeezed against a wall: every particle is at the same place to single precision's rounding."""
    cube = CUBE
    ends = cpp_reference.run(program, cube, warm_up=10, measurements=2, substeps=(SUBSTEPS - 10) // 2)
    assert len(ends.seconds) == 2
    moved = np.abs(ends.positions - cube.positions()).max()
    assert moved > 0.2 * cube.spacing
    assert np.ptp(ends.positions[:, 1]) < 0.97 * np.ptp(cube.positions()[:, 1])
    assert np.abs(ends.positions - simulated(cube)).max() < 1e-4 * moved


def test_a_program_is_compiled_once(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second time the one in the cache is taken, and a changed source would be another one."""
    monkeypatch.setenv("ZOOBENCH_CACHE", str(program.parents[1]))
    written = program.stat().st_mtime_ns
    assert cpp_reference.build() == program
    assert program.stat().st_mtime_ns == written
    monkeypatch.setattr(cpp_reference, "FLAGS", ("-O1", "-std=c++17"))
    assert cpp_reference.build() != program


def test_the_rate_is_work_by_processor_time(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Particles times substeps by the median of the measurements."""
    real = cpp_reference.run
    monkeypatch.setattr(
        cpp_reference, "run", lambda *given, **how: replace(real(*given, **how), seconds=(0.1, 0.2, 0.05, 0.1, 9.0))
    )
    assert cpp_reference.rate(program) == pytest.approx(Cube().particle_count * 50 / 0.1 / 1e6)


def test_what_is_missing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler, one that fails, and a program that does."""
    monkeypatch.setenv("ZOOBENCH_CACHE", str(tmp_path))
    failing = tmp_path / "failing"
    failing.write_text("#!/bin/sh\necho no such flag >&2\nexit 3\n")
    failing.chmod(0o755)
    monkeypatch.setenv("CXX", str(failing))
    with pytest.raises(NoReferenceError, match="no such flag"):
        cpp_reference.build()
    with pytest.raises(NoReferenceError, match="ended with 3"):
        cpp_reference.run(failing, CUBE, warm_up=0, measurements=1, substeps=1)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CXX")
    with pytest.raises(NoReferenceError, match=r"looked for c\+\+"):
        cpp_reference.build()
