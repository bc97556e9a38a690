"""A kernel that is launched again and again with the same arrays."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple
from weakref import ref

from taichi.lang import impl
from torch import Tensor

from zoobench.sim import runtime

_MOST_KEPT = 16
"""Sets of arguments of one kernel that are remembered."""


class _Prepared(NamedTuple):
    """What Taichi made of a launch: the compiled kernel and the context with its arguments, and the arrays in it."""

    kernel: Any
    context: Any
    arrays: tuple["ref[Tensor]", ...]


class Launch:
    """A kernel to be called like the one that it is given, faster where it was called so before.

    At every launch Taichi examines every argument, which takes longer than a thousand particles' substep. A launch with
    the arguments of an earlier one, the same tensors and equal other values, repeats that one as it was prepared. What
    the tensors hold may have changed, but not where they hold it. A launch is forgotten with the first of its tensors.

    On CUDA, where a context serves one launch, and with bounds checked, every launch is Taichi's own.

    Args:
        kernel: its array arguments are contiguous tensors on the runtime's device; it returns nothing.
        optimised: see `runtime.vector_lanes`.
    """

    def __init__(self, kernel: Callable[..., None], *, optimised: bool = False) -> None:
        self._kernel, self._optimised = kernel, optimised
        self._prepared: dict[tuple[Any, ...], _Prepared] = {}
        self._generation = -1

    def __call__(self, *arguments: Any) -> None:
        """Launch the kernel."""
        if not runtime.repeats_launches():
            with runtime.vector_lanes(optimised=self._optimised):
                self._kernel(*arguments)
            return
        if self._generation != runtime.generation():  # contexts end with the runtime
            self._prepared.clear()
            self._generation = runtime.generation()
        # isinstance is far slower on a number
        key = tuple([id(each) if type(each) is Tensor else each for each in arguments])
        if prepared := self._prepared.get(key):
            impl.get_runtime().prog.launch_kernel(prepared.kernel, prepared.context)
            return
        with _seen_launches() as seen, runtime.vector_lanes(optimised=self._optimised):
            self._kernel(*arguments)
        while len(self._prepared) >= _MOST_KEPT:
            self._prepared.pop(next(iter(self._prepared)))
        (launched,) = seen
        forget = self._forget(key)
        self._prepared[key] = _Prepared(
            *launched, tuple(ref(each, forget) for each in arguments if type(each) is Tensor)
        )

    def _forget(self, key: tuple[Any, ...]) -> Callable[[object], None]:
        """A callback that forgets a launch: another tensor may come to have the id of one that is gone."""
        launch = ref(self)  # what it is kept by must not keep it in a circle

        def forget(_: object) -> None:
            if alive := launch():
                alive._prepared.pop(key, None)

        return forget


@contextmanager
def _seen_launches() -> Iterator[list[tuple[Any, Any]]]:
    """Kernels and contexts that are handed to Taichi's runtime within."""
    seen: list[tuple[Any, Any]] = []
    kind = type(impl.get_runtime().prog)
    launch = kind.launch_kernel

    def watched(program: Any, kernel: Any, context: Any) -> None:
        seen.append((kernel, context))
        launch(program, kernel, context)

    kind.launch_kernel = watched
    try:
        yield seen
    finally:
        kind.launch_kernel = launch
