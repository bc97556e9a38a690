"""A kernel that is launched again and again with the same arrays."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, NamedTuple
from weakref import ref

from torch import Tensor

from zoobench.errors import UsageError
from zoobench.sim import runtime
from zoobench.sim.taichi_patches import SeenLaunch, seen_launches

_MOST_KEPT = 16
"""Sets of arguments of one kernel that are remembered."""


class _Prepared(NamedTuple):
    """A launch that was seen, and the arrays in it."""

    seen: SeenLaunch
    arrays: tuple["ref[Tensor]", ...]


class Launch:
    """A kernel to be called like the one that it is given, faster where it was called so before.

    At every launch Taichi examines every argument, which takes longer than a thousand particles' substep. A launch with
    the arguments of an earlier one, the same tensors and equal other values, repeats that one as it was prepared. What
    the tensors hold may have changed, but not where they hold it. A launch is forgotten with the first of its tensors.

    With bounds checked, every launch is Taichi's own.

    Args:
        kernel: its array arguments are contiguous tensors on the runtime's device; it returns nothing.
        optimised: see `runtime.vector_lanes`.
        lanes: whether to compile for those; not what adds atomically.
    """

    def __init__(self, kernel: Callable[..., None], *, optimised: bool = False, lanes: bool = True) -> None:
        self._kernel, self._optimised, self._lanes = kernel, optimised, lanes
        self._prepared: dict[tuple[Any, ...], _Prepared] = {}
        self._generation = runtime.generation()

    def __call__(self, *arguments: Any) -> None:
        """Launch the kernel.

        Raises:
            UsageError: the runtime in which this was made has ended, and with it the prepared launch.
        """
        if self._generation != runtime.generation():
            raise UsageError(
                "Taichi was restarted, by zoobench with another precision or device, or by a ti.init. "
                "Make a new solver, or a new environment."
            )
        if not runtime.repeats_launches():
            with self._compiling():
                self._kernel(*arguments)
            return
        # isinstance is far slower on a number
        key = tuple([id(each) if type(each) is Tensor else each for each in arguments])
        if prepared := self._prepared.get(key):
            prepared.seen.again(as_it_was=runtime.keeps_contexts())
            return
        with seen_launches() as seen, self._compiling():
            self._kernel(*arguments)
        while len(self._prepared) >= _MOST_KEPT:
            self._prepared.pop(next(iter(self._prepared)))
        (launched,) = seen
        forget = self._forget(key)
        self._prepared[key] = _Prepared(
            launched, tuple(ref(each, forget) for each in arguments if type(each) is Tensor)
        )

    def _compiling(self) -> AbstractContextManager[None]:
        """How the kernel is compiled if it is launched within for the first time."""
        return runtime.vector_lanes(optimised=self._optimised) if self._lanes else runtime.quick_compilation()

    def _forget(self, key: tuple[Any, ...]) -> Callable[[object], None]:
        """A callback that forgets a launch: another tensor may come to have the id of one that is gone."""
        launch = ref(self)  # what it is kept by must not keep it in a circle

        def forget(_: object) -> None:
            if alive := launch():
                alive._prepared.pop(key, None)

        return forget
