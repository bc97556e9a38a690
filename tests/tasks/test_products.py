"""Products and eigenvectors of small matrices, and readings that do not depend on the libraries' code."""

import json
import os
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from tests.tasks.motions import block, motion, with_object
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.cell.robot import elongation
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.products import matmul, symmetric_eigen

_OTHER_CODE = {
    "MKL_CBWR": "AVX2",
    "OPENBLAS_CORETYPE": "Nehalem",
    "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 X86_V3 X86_V4 AVX512F AVX512CD AVX512_SKX AVX512_ICL AVX512_SPR",
}
"""What libraries choose by the make of a processor; torch's own sums do not, and are set in `zoobench.rounding`."""


def synthetic() -> dict[str, object]:
    """All readings of a random motion, to the last bit."""
    rest, chance = block(count=60), torch.Generator().manual_seed(1)
    places, speeds = (torch.rand(61, *rest.shape, dtype=torch.float64, generator=chance) - 0.5 for _ in range(2))
    work = torch.rand(60, 1, 2, dtype=torch.float64, generator=chance)
    moved = motion(rest, rest + 0.02 * places, 0.1 * speeds, work)
    boxes = (torch.rand(61, 40, 3, dtype=torch.float64, generator=chance) * torch.tensor([0.06, 0.05, 0.04])).double()
    moved = with_object(moved, boxes[0], boxes[0] + 0.01 * boxes)
    found: dict[str, object] = {"elongation": elongation(places[0].numpy(), speeds[0, :, 0].abs().numpy()).hex()}
    for name in registry.names(Kind.TASK):
        task = registry.create(Kind.TASK, Ref.parse("mix[movement-speed=1,turning=1]" if name == "mix" else name))
        found[name] = [float(value).hex() for value in task.reward(moved)]
        found |= {f"{name} {key}": float(value).hex() for key, (value, _) in task.metrics(moved).items()}
    return found


def simulated() -> dict[str, object]:
    """All readings of two episodes."""
    found: dict[str, object] = {}
    for task in ("velocity-tracking", "turning"):
        problem = Problem(cell(task=task, controller="trajectory", frames=20), worlds=1)
        evaluation = problem.evaluate(np.random.default_rng(3).normal(size=problem.parameter_count))
        found[task] = [value.hex() for value in evaluation.reward.tolist()]
        found |= {f"{task} {name}": metric.value.hex() for name, metric in evaluation.metrics.items()}
    return found


@pytest.mark.slow  # tests/test_rounding.py shows that the libraries heed what is asked of them
@pytest.mark.parametrize("readings", [synthetic, simulated])
def test_no_reading_depends_on_the_libraries_choice_of_code(readings: Callable[[], dict[str, object]]) -> None:
    """All rewards and metrics, bit for bit, in a process with other code for products and decompositions."""
    name = readings.__name__
    script = f"import json; from tests.tasks.test_products import {name}; print(json.dumps({name}()))"
    child = [sys.executable, "-c", f"import zoobench; {script}"]
    ended = subprocess.run(child, env={**os.environ, **_OTHER_CODE}, capture_output=True, text=True, check=True)
    found = readings()
    assert len(found) > 10
    assert json.loads(ended.stdout.splitlines()[-1]) == found


def test_a_product_is_that_of_the_matrices() -> None:
    """Of batches, and differentiable."""
    one, other = (torch.rand(5, 3, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(k)) for k in (0, 1))
    torch.testing.assert_close(matmul(one, other), one @ other, rtol=1e-14, atol=1e-14)
    assert torch.autograd.gradcheck(matmul, (one.requires_grad_(), other.requires_grad_()))


@pytest.mark.parametrize("size", [2, 3, 4])
def test_eigenvectors_are_exact(size: int) -> None:
    """Orthonormal and to the last digits, for all sizes of numbers, equal eigenvalues, and no matrix at all."""
    rng = np.random.default_rng(size)
    basis = np.linalg.qr(rng.normal(size=(40, size, size)))[0]
    values = np.sort(rng.normal(size=(40, size)) * 10.0 ** rng.uniform(-12, 12, (40, 1)), axis=1)
    values[:5, 1] = values[:5, 0]
    values[5] = 0.0
    matrices = (basis * values[:, None, :]) @ basis.swapaxes(-1, -2)
    matrices = (matrices + matrices.swapaxes(-1, -2)) / 2
    found, vectors = symmetric_eigen(matrices)
    scale = np.abs(values).max(axis=1, initial=1e-300)[:, None]
    np.testing.assert_allclose(found / scale, values / scale, atol=4e-15)
    np.testing.assert_allclose(
        vectors.swapaxes(-1, -2) @ vectors, np.broadcast_to(np.eye(size), vectors.shape), atol=4e-15
    )
    rebuilt = (vectors * found[:, None, :]) @ vectors.swapaxes(-1, -2)
    np.testing.assert_allclose(rebuilt / scale[..., None], matrices / scale[..., None], atol=8e-15)


def test_the_rounding_of_a_matrix_does_not_depend_on_the_others() -> None:
    """Alone and in a batch the same bits."""
    matrices = np.random.default_rng(1).normal(size=(6, 4, 4))
    matrices += matrices.swapaxes(-1, -2)
    values, vectors = symmetric_eigen(matrices)
    alone = symmetric_eigen(matrices[4])
    np.testing.assert_array_equal(values[4], alone[0])
    np.testing.assert_array_equal(vectors[4], alone[1])
