"""`design export`."""

from pathlib import Path

import numpy as np

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from tests.report.content import add_ended
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.problem import Problem


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


def test_the_body_that_a_run_has_found_is_exported_and_drawn(zoobench: Command, tmp_path: Path) -> None:
    """Only what is solid, at the run's own fidelity; another one is refused where the parameters do not fit it."""
    spec = cell(design="particle", controller="fixed-sine")
    problem = Problem(spec)
    parameters = problem.initial(np.random.default_rng(0)).reshape(problem.body.particle_count, -1)
    kept = problem.body.positions[:, 0] > 0.0
    parameters[:, 0] = np.where(kept, 5.0, -5.0)
    ending = Ending(RunState.DONE, finals=(FinalRow("score", 0.1, "m/s"),), params=tuple(parameters.ravel().tolist()))
    with Store(tmp_path / "zoobench.db") as store:
        add_ended(store, spec, ending)
    reply = zoobench("design", "export", "1", "-o", "body.npz")
    assert (reply.code, reply.out) == (0, "body.npz\n"), reply.err
    with np.load("body.npz") as found:
        np.testing.assert_array_equal(found["positions"], problem.body.positions[kept])
    assert zoobench("show", "1", "--picture", "body.png").code == 0
    assert Path("body.png").read_bytes().startswith(b"\x89PNG")
    finer = zoobench("design", "export", "1", "-o", "body.npz", "--fidelity", "draft")
    assert finer.code == 2
    assert "describe no particle body" in finer.err
