"""Kernels through Taichi's quickened front end compute what their Python says."""
# ruff: noqa: ANN001, ANN202  (the arguments of kernels are typed by the kernel compiler)

import ast
from pathlib import Path

import pytest
import taichi as ti
import torch

from zoobench.sim import runtime, taichi_patches
from zoobench.sim.kernels.array_types import Scalars

ROOT = Path(__file__).parents[2]


@ti.func
def _twice(given):
    """Twice of what was given, by names that the caller has, too."""
    value = given + given
    given_again = value
    value += 1.0
    return given_again


@ti.func
def _both(one, other):
    """Two numbers in the other order."""
    return other, one


@ti.func
def _replaced(out: ti.template(), given):
    """An element of an array, which is changed before it is used."""
    out[0] = -1.0
    return given


@ti.kernel
def _compute(out: Scalars):
    """Everything that is assigned differently."""
    for i in range(1):
        value = out[0] + ti.cast(i, float)  # 3
        other = value
        value += 2.0  # a copy stays what it was
        out[1] = other
        value, other = other, value
        out[2], out[3] = value, other
        first = second = _twice(value)
        first -= 1.0
        out[4], out[5] = first, second
        pair = ti.Struct(x=value, y=other)
        kept = pair
        pair.x = 7.0
        value = 8.0
        out[6], out[7], out[8] = pair.x, kept.x, pair.y
        left, right = _both(value, other)
        value = 9.0
        out[9], out[10] = left, right
        row = ti.Vector([1.0, 2.0, 3.0])
        rows = [row, row]
        rows[0] += row
        row[1] = 5.0
        x, y, z = row
        out[11], out[12], out[13] = rows[0][1], rows[1][1], x + y + z
        out[14] += 4.0
        out[14] -= 1.0
        left, right = right, left
        out[15] = left - right
        out[16] = _replaced(out, out[0])


def test_assignments_copy_as_in_taichi() -> None:
    """Copies stay what they were when the original changes, names swap, and arrays are added to."""
    runtime.start(64)
    out = torch.zeros(17, dtype=torch.float64)
    out[0], out[14] = 3.0, 1.0
    with taichi_patches.quickened(quotes=False):
        _compute(out)
    assert out.tolist() == [-1.0, 3.0, 3.0, 5.0, 5.0, 6.0, 7.0, 3.0, 5.0, 5.0, 8.0, 4.0, 2.0, 9.0, 4.0, 3.0, 3.0]


def test_variables_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """An argument that is a variable is no copy, and neither is what a change in place computes."""
    runtime.start(64)
    made = []
    copy = taichi_patches._COPY
    monkeypatch.setattr(taichi_patches, "_COPY", lambda given: (made.append(given), copy(given))[1])

    @ti.kernel
    def compute(out: Scalars):
        for i in range(1):
            value = out[i]
            out[1] = _twice(value) + _twice(value + 1.0)

    out = torch.tensor([3.0, 0.0], dtype=torch.float64)
    with taichi_patches.quickened(quotes=False):
        compute(out)
    assert out[1] == 14.0
    assert len(made) == 1


@ti.func
def _clamped(given, most):
    """As other people write it: the argument is a copy."""
    if given > most:
        given = most
    return given


def _of_other_code():
    """A kernel that is compiled at its first call."""

    @ti.kernel
    def compute(out: Scalars):
        for _ in range(1):
            value = out[0]
            out[1] = _clamped(value, 1.0)
            out[2] = value

    return compute


def test_kernels_of_other_code_are_compiled_as_taichi_does() -> None:
    """After one of zoobench's, and after one that could not be compiled."""

    @ti.kernel
    def fails(out: Scalars):
        out[0] = missing  # noqa: F821

    runtime.start(64)
    out = torch.tensor([5.0, 0.0, 0.0], dtype=torch.float64)
    with taichi_patches.quickened(quotes=False):
        _of_other_code()(out)
    assert out.tolist() == [5.0, 1.0, 1.0]  # what it must not get
    with pytest.raises(ti.TaichiNameError), taichi_patches.quickened(quotes=True):
        fails(out)
    _of_other_code()(out)
    assert out.tolist() == [5.0, 1.0, 5.0]


def test_no_function_of_a_kernel_assigns_to_its_arguments() -> None:
    """It has the caller's own variables."""
    paths = [path for folder in ("zoobench", "tests") for path in (ROOT / folder / "sim").rglob("*.py")]
    nodes = [node for path in paths for node in ast.walk(ast.parse(path.read_text()))]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef) and _is_of_a_kernel(node)]
    functions = [node for node in functions if node.name != "_clamped"]  # as other people write it
    assert len(functions) > 100
    for function in functions:
        targets = [each for each in ast.walk(function) if isinstance(each, ast.Name | ast.Subscript)]
        changed = {_root(each) for each in targets if isinstance(each.ctx, ast.Store)}
        assert not {argument.arg for argument in function.args.args if argument.annotation is None} & changed


def _is_of_a_kernel(function: ast.FunctionDef) -> bool:
    return "ti.func" in map(ast.unparse, function.decorator_list)


def _root(target: ast.expr) -> str:
    """The variable that an assignment changes, or a part of it."""
    return ast.unparse(target).partition("[")[0]
