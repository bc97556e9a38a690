"""What is said of bodies from files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.harness.imported import body_notes
from zoobench.registry import Kind
from zoobench.spec import Ref


@pytest.mark.parametrize(("stiffness", "said"), [(0.1, 1), (1.0, 0)])
def test_muscles_that_their_matter_does_not_bear_are_told_of(tmp_path: Path, stiffness: float, said: int) -> None:
    """Once for each environment, however many runs there are."""
    along = np.arange(8) * 0.01
    positions = np.stack(np.meshgrid(along, along[:4], along[:4], indexing="ij"), axis=-1).reshape(-1, 3)
    np.savez(tmp_path / "soft.npz", positions=positions, stiffness=np.full(len(positions), stiffness))
    design = registry.resolve(Kind.DESIGN, Ref.parse(f"cloud[path={tmp_path / 'soft.npz'}]"))
    spec = replace(cell(), design=design)
    notes = [note for note in body_notes([spec, replace(spec, seed=1)]) if "too soft" in note]
    assert notes == ["cloud: Parts are too soft for their muscles in ground, which are weaker there."] * said
