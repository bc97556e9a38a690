"""`design export` and `design picture`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from tests.render.filmed import needs_drawing
from tests.report.content import add_ended
from zoobench.arrays import Mask
from zoobench.cell.problem import Problem
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.designs.base import Body
from zoobench.methods.archive import Archive
from zoobench.spec import Ref


def _no_slivers(body: Body) -> Mask:
    """The particles of more than a tenth of a cube; those at the block's corners touch nothing, and are not built."""
    return np.asarray(body.volumes > 0.1 * body.edge**3)


def test_export_writes_what_was_asked_for(zoobench: Command) -> None:
    """At the fidelity named; the path is the data."""
    reply = zoobench("design", "export", "caterpillar", "-o", "body.npz", "--fidelity", "draft")
    assert reply.out == "body.npz\n"
    assert "428 particles" in reply.err
    with np.load("body.npz") as found:
        assert found["positions"].shape == (428, 3)


def test_export_refuses_what_it_cannot_do(zoobench: Command) -> None:
    """An unknown design, an unknown ending; nothing is written."""
    assert zoobench("design", "export", "catterpillar", "-o", "a.npz").code == 2
    assert "ends in" in zoobench("design", "export", "caterpillar", "-o", "a.doc").err
    assert not list(Path().glob("a.*"))


def test_the_archive_of_a_run_is_written_and_its_bodies_are_exported(zoobench: Command, tmp_path: Path) -> None:
    """As table, map and arrays; one elite by its number; what has none, or is none, is refused with the reason."""
    pytest.importorskip("matplotlib")
    spec = cell(design="particle", controller="fixed-sine", method="quality-diversity")
    problem = Problem(spec)
    front, whole = problem.body.positions[:, 0] > 0.0, _no_slivers(problem.body)
    halves = (front & whole, ~front & whole)
    params = np.zeros((2, problem.parameter_count))
    for number, kept in enumerate(halves):
        params[number].reshape(len(front), -1)[:, 0] = np.where(kept, 5.0, -5.0)
    archive = Archive(params, np.array([0.2, 0.1]), np.array([[0.5, 0.3], [0.4, 1.0]]), ("volume", "elongation"), 10)
    finals = (FinalRow("score", 0.2, "m/s"),)
    ending = Ending(RunState.DONE, finals=finals, params=tuple(params[0].tolist()), archive=archive.to_bytes())
    with Store(tmp_path / "zoobench.db") as store:
        add_ended(store, spec, ending)
        add_ended(store, replace(spec, method=Ref("cmaes", 1)), replace(ending, archive=None))
    reply = zoobench("design", "archive", "1", "-o", "a.csv")
    assert (reply.code, reply.out) == (0, "a.csv\n"), reply.err
    assert "2 elites in 100 cells" in reply.err
    assert Path("a.csv").read_text() == "elite,score [m/s],volume,elongation\n1,0.2,0.5,0.3\n2,0.1,0.4,1.0\n"
    assert zoobench("design", "archive", "1", "-o", "a.png").code == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert zoobench("design", "archive", "1", "-o", "a.npz").code == 0
    with np.load("a.npz") as found:
        np.testing.assert_array_equal(found["params"], params)
    for elite, kept in zip("12", halves, strict=True):
        assert zoobench("design", "export", "1", "--elite", elite, "-o", "body.npz").code == 0
        with np.load("body.npz") as found:
            np.testing.assert_array_equal(found["positions"], problem.body.positions[kept])
    refused = {
        ("archive", "2", "-o", "a.csv"): "kept no archive: its method is cmaes",
        ("archive", "1", "-o", "a.doc"): ".csv, .npz or .png",
        ("archive", "1", "-o", "nowhere/a.csv"): "cannot be written",
        ("export", "1", "--elite", "3", "-o", "b.npz"): "no elite 3 in an archive of 2",
        ("export", "2", "--elite", "1", "-o", "b.npz"): "kept no archive",
        ("export", "panda", "--elite", "1", "-o", "b.npz"): "is a design",
    }
    for words, message in refused.items():
        reply = zoobench("design", *words)
        assert reply.code == 2
        assert message in reply.err


@pytest.mark.slow
def test_the_body_that_a_run_has_found_is_exported_and_drawn(zoobench: Command, tmp_path: Path) -> None:
    """Only what is solid, at the run's own fidelity; another one is refused where the parameters do not fit it."""
    spec = cell(design="particle", controller="fixed-sine")
    problem = Problem(spec)
    parameters = problem.initial(np.random.default_rng(0)).reshape(problem.body.particle_count, -1)
    kept = (problem.body.positions[:, 0] > 0.0) & _no_slivers(problem.body)
    parameters[:, 0] = np.where(kept, 5.0, -5.0)
    ending = Ending(RunState.DONE, finals=(FinalRow("score", 0.1, "m/s"),), params=tuple(parameters.ravel().tolist()))
    with Store(tmp_path / "zoobench.db") as store:
        add_ended(store, spec, ending)
    reply = zoobench("design", "export", "1", "-o", "body.npz")
    assert (reply.code, reply.out) == (0, "body.npz\n"), reply.err
    with np.load("body.npz") as found:
        np.testing.assert_array_equal(found["positions"], problem.body.positions[kept])
    finer = zoobench("design", "export", "1", "-o", "body.npz", "--fidelity", "draft")
    assert finer.code == 2
    assert "describe no particle body" in finer.err
    needs_drawing()
    assert zoobench("show", "1", "--picture", "body.png").code == 0
    assert Path("body.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_published_body_of_a_swimmer_is_exported(zoobench: Command) -> None:
    """As it was simulated: in its rest frame, where its thin parts have fewer particles, so that voxels are fewer."""
    reply = zoobench("design", "export", "best:design/ocean/movement-speed/voxel", "-o", "body.npz")
    assert (reply.code, reply.out) == (0, "body.npz\n"), reply.err


@pytest.mark.slow
def test_picture_prints_the_files_that_it_wrote(zoobench: Command, tmp_path: Path) -> None:
    """One for each environment where the body can be and the sheet, on standard output alone."""
    needs_drawing()
    reply = zoobench(
        "design", "picture", "--design", "gripper", "--env", "ground,ice,ocean", "--fidelity", "smoke", "--out",
        tmp_path / "made",
    )  # fmt: skip
    assert reply.code == 0, reply.err
    assert "ocean: left out" in reply.err
    paths = [Path(line) for line in reply.out.splitlines()]
    assert [path.name for path in paths] == ["ground.png", "ice.png", "environments.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
