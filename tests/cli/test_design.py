"""`design export`."""

from pathlib import Path

import numpy as np

from tests.cli.conftest import Command


def test_export_writes_what_was_asked_for(zoobench: Command) -> None:
    """At the fidelity named; the path is the data."""
    reply = zoobench("design", "export", "caterpillar", "-o", "body.npz", "--fidelity", "draft")
    assert reply.out == "body.npz\n"
    assert "324 particles" in reply.err
    with np.load("body.npz") as found:
        assert found["positions"].shape == (324, 3)


def test_export_refuses_what_it_cannot_do(zoobench: Command) -> None:
    """An unknown design, an unknown ending, particles that are on no cubic lattice."""
    assert zoobench("design", "export", "catterpillar", "-o", "a.npz").code == 2
    assert "ends in" in zoobench("design", "export", "caterpillar", "-o", "a.doc").err
    fcc = ("--fidelity", "draft[particles_per_cell=4]")
    assert "cubic" in zoobench("design", "export", "caterpillar", "-o", "a.stl", *fcc).err
    assert not Path("a.stl").exists()
