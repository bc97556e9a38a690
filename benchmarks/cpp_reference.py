"""The rate of a small C++ program that simulates a cube of elastic matter: `python -m benchmarks.cpp_reference`.

It is the measure of a machine, with which rates of the simulator on others can be compared, and a second
implementation of the method. The program, `reference.cpp`, is compiled with the system's compiler, or that of CXX, and
kept in the cache folder.
"""

import hashlib
import os
import platform
import shutil
import statistics
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import ZoobenchError
from zoobench.files import cache_folder
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.model.laws.elastic import lame_parameters

FLAGS = ("-O3", "-march=native", "-std=c++17")

_SOURCE = Path(__file__).with_name("reference.cpp")
_SECONDS = 120.0  # for a compilation, and for a run


class NoReferenceError(ZoobenchError):
    """The program cannot be compiled or run here."""


@dataclass(frozen=True)
class Cube:
    """A cube of neo-Hookean particles, 8 per cell, that falls onto the lowest wall.

    Attributes:
        edge: particles along an edge.
        cells: of the arena between its walls, along an edge.
        height: of its lower face above the wall [cells].
    """

    edge: int = 22
    cells: int = 58
    height: float = 1.0
    spacing: float = 1 / 64
    dt: float = 2e-4
    youngs_modulus: float = 1e5
    poissons_ratio: float = 0.2
    density: float = 1000.0
    gravity: float = -9.81

    @property
    def particle_count(self) -> int:
        """Number of particles."""
        return self.edge**3

    @property
    def particle_volume(self) -> float:
        """Of each particle [m^3]."""
        return self.spacing**3 / 8

    def positions(self) -> Array:
        """`[particle_count, 3]` from the arena's lower corner [m]."""
        places = np.stack(np.meshgrid(*3 * [np.arange(self.edge) + 0.5], indexing="ij"), axis=-1).reshape(-1, 3)
        middle = (self.cells - self.edge / 2) / 2
        corner: Array = (places / 2 + np.array([middle, self.height, middle])) * self.spacing
        return corner


@dataclass(frozen=True)
class Measurement:
    """What a run of the program gave.

    Attributes:
        seconds: processor time of each measurement [s].
        positions: `[particle_count, 3]` at the end, from the arena's lower corner [m].
    """

    seconds: tuple[float, ...]
    positions: Array


def build() -> Path:
    """The compiled program; it is compiled where that has not been done yet.

    Raises:
        NoReferenceError: there is no compiler, or it fails.
    """
    compiler = find_compiler()
    source = _SOURCE.read_bytes()
    # compiled for the very processor: a folder may be shared by several machines
    origin = "\0".join([compiler, *FLAGS, platform.node(), platform.machine()]).encode()
    program = cache_folder() / "bench" / f"reference-{hashlib.sha256(source + origin).hexdigest()[:16]}"
    if not program.exists():
        _compile(compiler, program)
    return program


def find_compiler() -> str:
    """The system's C++ compiler, the one that CXX names before all others.

    Raises:
        NoReferenceError: there is none.
    """
    names = [name for name in (os.environ.get("CXX"), "c++", "g++", "clang++") if name]
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        raise NoReferenceError(f"There is no C++ compiler; looked for {', '.join(names)}.")
    return found


def run(program: Path, cube: Cube, *, warm_up: int, measurements: int, substeps: int) -> Measurement:
    """Simulate the cube: `warm_up` substeps, and then as many measurements of `substeps` each.

    Raises:
        NoReferenceError: the program fails.
    """
    margin = WALL_NODES * cube.spacing
    moduli = lame_parameters(cube.youngs_modulus, cube.poissons_ratio)
    header: Sequence[float] = (
        *3 * [cube.cells + 2 * WALL_NODES + 1], cube.spacing, cube.dt, *moduli,
        cube.gravity, cube.particle_volume, cube.particle_volume * cube.density,
        warm_up, measurements, substeps, cube.particle_count,
    )  # fmt: skip
    lines = [" ".join(f"{number:.9g}" for number in row) for row in [header, *(cube.positions() + margin).tolist()]]
    advice = f"Delete {program} to compile it anew."
    try:
        done = subprocess.run(
            [str(program)], input="\n".join(lines), capture_output=True, text=True, timeout=_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NoReferenceError(f"The C++ reference does not run: {error}. {advice}") from error
    if done.returncode:
        raise NoReferenceError(f"The C++ reference ended with {done.returncode}. {advice}")
    printed = done.stdout.splitlines()
    positions = np.array([line.split() for line in printed[measurements:]], dtype=np.float64) - margin
    return Measurement(tuple(float(line) for line in printed[:measurements]), positions)


def rate(program: Path) -> float:
    """Million particle-substeps per second of processor time, the median of a few measurements.

    Raises:
        NoReferenceError: the program fails.
    """
    cube, substeps = Cube(), 50
    seconds = run(program, cube, warm_up=20, measurements=5, substeps=substeps).seconds
    return cube.particle_count * substeps / 1e6 / statistics.median(seconds)


def _compile(compiler: str, program: Path) -> None:
    part = program.with_name(f"{program.name}.{os.getpid()}")
    part.parent.mkdir(parents=True, exist_ok=True)
    try:
        done = subprocess.run(
            [compiler, *FLAGS, "-o", str(part), str(_SOURCE)],
            capture_output=True, text=True, timeout=_SECONDS, check=False,
        )  # fmt: skip
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:] or ["no message"]
            raise NoReferenceError(f"{compiler} cannot compile the C++ reference: {last[0]}")
        part.replace(program)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NoReferenceError(f"{compiler} cannot compile the C++ reference: {error}") from error
    finally:
        part.unlink(missing_ok=True)


if __name__ == "__main__":
    print(f"{rate(build()):.3g} million particle-substeps per second of processor time")
