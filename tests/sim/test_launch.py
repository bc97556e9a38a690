"""Launches that are prepared once and repeated."""

import gc
from collections.abc import Callable

import pytest
import taichi as ti
import torch
from taichi.lang import kernel_impl
from torch import Tensor

from zoobench.errors import UsageError
from zoobench.sim import runtime, taichi_patches
from zoobench.sim.launch import Launch

Values = ti.types.ndarray(dtype=ti.f32, ndim=1)


@ti.kernel
def add_to(total: Values, part: Values, factor: float, power: ti.template()):  # noqa: ANN201  # Taichi takes no None
    """total += factor part^power"""
    for i in range(part.shape[0]):
        total[i] += factor * part[i] ** power


@pytest.fixture
def taichis(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A runtime of 32 bits, and the launches that Taichi prepared, by the name of their kernel."""
    runtime.start(32)
    seen: list[str] = []
    launch = kernel_impl.Kernel.launch_kernel

    def watched(kernel: kernel_impl.Kernel, *arguments: object) -> None:
        seen.append(kernel.func.__name__)
        launch(kernel, *arguments)

    monkeypatch.setattr(kernel_impl.Kernel, "launch_kernel", watched)
    return seen


def _pair() -> tuple[Tensor, Tensor]:
    return torch.zeros(3), torch.tensor([1.0, 2.0, 3.0])


def test_a_repeated_launch_reads_what_its_arrays_hold_now(taichis: list[str]) -> None:
    """Taichi prepares the first alone."""
    total, part = _pair()
    launch = Launch(add_to)
    for number in range(5):
        part[0] = number
        launch(total, part, 2.0, 1)
    assert total.tolist() == [20.0, 20.0, 30.0]
    assert taichis == ["add_to"]


def test_a_context_that_serves_once_is_made_anew(taichis: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a GPU: by the same calls, without Taichi's examination."""
    made: list[object] = []
    make = taichi_patches.taichi_python.Kernel.make_launch_context
    monkeypatch.setattr(
        taichi_patches.taichi_python.Kernel, "make_launch_context", lambda kernel: made.append(kernel) or make(kernel)
    )
    monkeypatch.setattr(runtime, "keeps_contexts", lambda: False)
    total, part = _pair()
    launch = Launch(add_to)
    for _ in range(3):
        launch(total, part, 2.0, 1)
    assert total.tolist() == [6.0, 12.0, 18.0]
    assert (taichis, len(made)) == (["add_to"], 3)


def test_other_arguments_are_another_launch(taichis: list[str]) -> None:
    """Another number, template or array; of two sets of arguments in turn each is prepared once."""
    total, part = _pair()
    launch = Launch(add_to)
    for _ in range(3):
        launch(total, part, 1.0, 1)
        launch(total, part, 0.5, 1)
        launch(total, part, 1.0, 2)
        launch(part, part, 0.0, 1)
    assert total.tolist() == [7.5, 21.0, 40.5]
    assert len(taichis) == 4


def test_an_array_in_the_place_of_one_that_is_gone_is_another(taichis: list[str]) -> None:
    """Though Python gives it the same id."""
    total, ids = torch.zeros(3), set()
    launch = Launch(add_to)
    for number in range(1, 21):
        part = torch.full((3,), float(number))
        ids.add(id(part))
        launch(total, part, 1.0, 1)
        del part
    assert total.tolist() == [210.0] * 3
    assert len(ids) < 20  # else nothing was tested


def test_what_it_remembers_keeps_no_array_alive_and_is_bounded(taichis: list[str]) -> None:
    """A solver that is gone leaves no memory behind, and there is no end of numbers."""
    launch = Launch(add_to)
    total, part = _pair()
    for number in range(100):
        launch(total, part, float(number), 1)
    assert len(launch._prepared) <= 16
    assert total.tolist() == [4950.0, 9900.0, 14850.0]
    kept = [array for prepared in launch._prepared.values() for array in prepared.arrays]
    del total, part
    gc.collect()  # Taichi's compiler leaves circles
    assert kept
    assert all(array() is None for array in kept)


@pytest.mark.parametrize("restart", [lambda: (runtime.stop(), runtime.start(32)), lambda: ti.init(ti.cpu)])
def test_after_a_restart_of_taichi_no_launch_goes_on(taichis: list[str], restart: Callable[[], object]) -> None:
    """By zoobench or by other code: compiled kernels have ended with it, and new ones might compute other bits."""
    total, part = _pair()
    launch = Launch(add_to)
    launch(total, part, 1.0, 1)
    restart()
    with pytest.raises(UsageError, match="Make a new solver"):
        launch(total, part, 1.0, 1)
    runtime.start(32)
    Launch(add_to)(total, part, 1.0, 1)
    assert total.tolist() == [2.0, 4.0, 6.0]


@ti.kernel
def _double_beyond(values: Values, count: int):  # noqa: ANN202
    for i in range(count):
        values[i] *= 2.0


def test_where_bounds_are_checked_every_launch_is_checked() -> None:
    """A launch that is told of an error is Taichi's own."""
    runtime.start(32, debug=True)
    try:
        launch, values = Launch(_double_beyond), torch.ones(3)
        launch(values, 3)
        launch(values, 3)
        assert values.tolist() == [4.0] * 3
        with pytest.raises(ti.TaichiAssertionError):
            launch(values, 4)
    finally:
        runtime.stop()
