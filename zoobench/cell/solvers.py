"""The solvers of one scene: kept by their number of worlds, all starting from the same equilibrium."""

from typing import TYPE_CHECKING

from zoobench.cell.object_rest import object_fault
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.spec import FRAME_SECONDS

if TYPE_CHECKING:
    from zoobench.sim.model.state import Matter
    from zoobench.sim.solver import Solver


class Solvers:
    """Solvers of one scene at one fidelity.

    Args:
        scene, fidelity: of the simulation.
        equilibration_frames: control frames in which the scene comes to rest before the episode; 0 for none.
    """

    def __init__(self, scene: Scene, fidelity: Fidelity, equilibration_frames: int) -> None:
        self._scene, self._fidelity, self._equilibration_frames = scene, fidelity, equilibration_frames
        self._start: Matter | None = None
        self._is_checked = not scene.objects
        self._kept: dict[tuple[int, bool], Solver] = {}

    def get(self, worlds: int, gradient: bool) -> "Solver":
        """The kept solver of this width; the last batch of a method may be narrower than the others."""
        key = (worlds, gradient)
        for other, solver in self._kept.items():
            if gradient and other != key:
                solver.release()  # the memory is that of one tape
        if key not in self._kept:
            self._kept[key] = self.new(worlds, gradient=gradient)
        return self._kept[key]

    def new(self, worlds: int, *, gradient: bool = False, keeps_rest: bool = True) -> "Solver":
        """A solver for one user alone.

        Args:
            worlds: side by side.
            gradient: whether it keeps states for gradients.
            keeps_rest: whether the scene's state of rest may be asked for again by another process.

        Raises:
            UsageError: `worlds` is less than 1, or there is no GPU for a fidelity that asks for one.
            SceneError: an object is not where it was put after the equilibration.
        """
        from zoobench.sim.solver import Solver

        solver = Solver(
            self._scene,
            self._fidelity,
            worlds=worlds,
            frame_seconds=FRAME_SECONDS,
            gradients=gradient,
            start=self._equilibrated(keeps_rest),
        )
        if not self._is_checked:
            if fault := object_fault(self._scene, solver.positions(0)):
                raise SceneError(fault)
            self._is_checked = True
        return solver

    def most_worlds(self, frames: int, substeps: int) -> int:
        """Worlds side by side of which every state of an episode fits into memory, at least 1.

        Side by side they share launches only, which saves less than it costs to simulate an episode again.

        Args:
            frames, substeps: of an episode.
        """
        from zoobench.sim.memory_budget import memory_share
        from zoobench.sim.solver import episode_memory

        return max(
            1, memory_share(self._fidelity.device) // episode_memory(self._scene, self._fidelity, frames, substeps)
        )

    def _equilibrated(self, is_kept: bool) -> "Matter | None":
        """The equilibrated scene, computed or read from the cache once; None without equilibration."""
        from zoobench.sim.equilibrium import equilibrated
        from zoobench.sim.runtime import check_device

        if self._start is None:
            check_device(self._fidelity.device)  # the scene comes to rest on the CPU, which can take minutes
            self._start = equilibrated(
                self._scene,
                self._fidelity,
                self._equilibration_frames,
                frame_seconds=FRAME_SECONDS,
                is_kept=is_kept,
            )
        return self._start
