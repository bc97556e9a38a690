"""The short way to what Taichi asks of every kernel function: whether it is defined in a class."""

import inspect

import pytest
import taichi as ti
from taichi.lang import kernel_impl

from zoobench.sim import kernels


def test_kernels_of_a_class_are_told_from_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """As by Taichi's own way, but without a search through all modules."""
    monkeypatch.setattr(inspect, "getmodule", lambda *_: pytest.fail("a search through all modules"))

    @ti.data_oriented
    class Counter:
        @ti.kernel
        def one(self) -> int:
            return 1

    @ti.kernel
    def two() -> int:
        return 2

    assert kernel_impl._inside_class is kernels._inside_class
    assert Counter.__dict__["one"]._is_classkernel
    assert not two._is_classkernel


def test_a_function_of_a_script_is_in_no_class() -> None:
    """There are fewer frames around it than Taichi asks for."""
    assert not kernels._inside_class(10_000)
