"""Equilibrated states of scenes, kept in files next to the compiled kernels and read back later.

The file's name is a hash of everything that determines the state, the simulator's own sources included, so that a file
is never out of date. It holds the result of `come_to_rest` bit for bit.
"""

import contextlib
import hashlib
import io
import platform
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti
import torch

from zoobench.files import cache_folder, hash_of_sources, replace_files
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.state import Matter
from zoobench.sim.model.tensors import put
from zoobench.sim.rest import come_to_rest
from zoobench.sim.solver import Solver

LARGEST_FOLDER = 2 * 2**30
"""Size of the stored states [bytes]; the longest unused go first.

A bed's takes up to 35 MB at `fine` and 90 at 1/256 m, where it took a core 15 minutes: those of a study of four animals
in two beds shall fit."""

_DIGEST_BYTES = 32

_TENSORS = ("state", "window", "flow", "nodes")

_PROCESSOR_LINES = ("model name", "flags", "CPU part", "Features")
"""Lines of /proc/cpuinfo: the first two on x86, the others on ARM."""


def equilibrated(
    scene: Scene, fidelity: Fidelity, frames: int, *, frame_seconds: float = 0.008, is_kept: bool = True
) -> Matter | None:
    """The scene's state of rest, for `Solver(..., start=...)`: see `come_to_rest`; None for no frames.

    Objects come to rest too, and then begin with the velocities that the scene gives them.

    A damaged file is replaced, and where no file can be written the state is computed every time. One that is not to be
    kept, as it will not be asked for again, is not written.

    Raises:
        DivergenceError: the scene diverges.
    """
    if not frames:
        return None
    # all matter moves until it rests; on the CPU, where that repeats bit for bit and one world is simulated faster
    fidelity = replace(fidelity, sleep=0.0, device="cpu")
    still = _with_objects_at_rest(scene)
    path = state_folder() / f"{_key(still, fidelity, frames, frame_seconds)}.npz"
    kept = _read(path)
    if kept is None:
        kept = come_to_rest(Solver(still, fidelity, frame_seconds=frame_seconds), frames)
        if is_kept:
            with contextlib.suppress(OSError):
                _write(path, kept)
                _trim(path.parent)
    for each in scene.objects:
        if each.body.velocities.any():
            put(kept.v[:, :, scene.slice_of(each.name)], each.body.velocities)
    return kept


def _with_objects_at_rest(scene: Scene) -> Scene:
    bodies = [replace(each.body, velocities=np.zeros_like(each.body.velocities)) for each in scene.objects]
    return replace(
        scene, objects=tuple(replace(each, body=body) for each, body in zip(scene.objects, bodies, strict=True))
    )


def state_folder() -> Path:
    """The folder of equilibrated states, next to the compiled kernels."""
    return cache_folder() / "equilibrated"


def _key(scene: Scene, fidelity: Fidelity, frames: int, frame_seconds: float) -> str:
    """A hash of everything that determines the state, processor and compilers too: they differ in rounding."""
    digest = hashlib.sha256()
    for value in (_sources(), scene, fidelity, frames, frame_seconds, processor(), ti.__version__, torch.__version__):
        _feed(digest, value)
    return digest.hexdigest()


def _feed(digest: "hashlib._Hash", value: Any) -> None:
    """Add a value of plain data to the digest: dataclasses, tuples and arrays by content, the rest as it
    prints."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value):
        digest.update(f"{type(value).__name__}(".encode())
        for item in fields(value):
            digest.update(f"{item.name}=".encode())
            _feed(digest, getattr(value, item.name))
        digest.update(b")")
    elif isinstance(value, tuple):
        digest.update(f"{len(value)}(".encode())
        for item in value:
            _feed(digest, item)
    else:
        digest.update(f"{value!r};".encode())


@cache
def processor() -> str:
    """The processor's model and instruction sets, by which kernels are compiled and mathematical functions chosen.

    Machines that share a folder may differ in both, and results differ where only some have fused multiplication.
    """
    try:
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:  # no Linux
        lines = []
    told = sorted({line for line in lines if line.startswith(_PROCESSOR_LINES)})
    return "\n".join([platform.machine(), platform.processor(), *told])


@cache
def _sources() -> str:
    """A hash of the simulator's sources, which hold the physics."""
    return hash_of_sources(Path(__file__).parent)


def _read(path: Path) -> Matter | None:
    """The state in a file; None if there is no file or it is damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    payload = content[_DIGEST_BYTES:]
    if hashlib.sha256(payload).digest() != content[:_DIGEST_BYTES]:
        return None
    with contextlib.suppress(OSError):
        path.touch()  # when it was last used
    with np.load(io.BytesIO(payload), allow_pickle=False) as arrays:
        state, window, flow, nodes = (torch.from_numpy(arrays[name]) for name in _TENSORS)
        return Matter(state, window, flow, int(arrays["robot"]), nodes)


def _write(path: Path, matter: Matter) -> None:
    """Write a state after its digest."""
    buffer = io.BytesIO()
    arrays = {name: getattr(matter, name).cpu().numpy() for name in _TENSORS}
    np.savez(buffer, **arrays, robot=np.asarray(matter.robot))
    payload = buffer.getvalue()
    replace_files({path: hashlib.sha256(payload).digest() + payload}, make_folders=True)


def _trim(folder: Path) -> None:
    """Remove the longest unused files, those that a killed process left incomplete too, beyond the folder's size."""
    entries = sorted((stat.st_mtime, stat.st_size, path) for path in folder.iterdir() if (stat := path.stat()))
    total = sum(size for _, size, _ in entries)
    for _, size, path in entries[:-1]:
        if total <= LARGEST_FOLDER:
            break
        path.unlink(missing_ok=True)
        total -= size
