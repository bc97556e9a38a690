"""`render`."""

from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.render.filmed import SPEC, needs_drawing, params, short_film
from tests.report.content import add_ended
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store


def stored(path: Path, score: float, *others: FinalRow) -> Path:
    """A database whose run 1 is that of the short film, with this score."""
    ending = Ending(RunState.DONE, finals=(FinalRow("score", score, "m"), *others), params=params())
    with Store(path) as store:
        add_ended(store, SPEC, ending)
    return path


def test_a_run_is_filmed_from_what_is_stored(zoobench: Command, tmp_path: Path) -> None:
    """The file's name is the data; the episode is the one that was scored, so nothing is said about the score."""
    stored(tmp_path / "zoobench.db", short_film().evaluation.score)
    reply = zoobench("render", "1", "-o", "run", "--format", "npz", "--every", 5)
    assert (reply.code, reply.out) == (0, "run.npz\n"), reply.err
    assert "simulating 10 frames" in reply.err
    assert "is stored" not in reply.err
    with np.load(tmp_path / "run.npz") as found:
        np.testing.assert_array_equal(found["robot"], short_film().robot)


def test_a_picture_is_drawn(zoobench: Command, tmp_path: Path) -> None:
    """A run is known by the start of its key too; another score than the stored one is told."""
    needs_drawing()
    stored(tmp_path / "zoobench.db", -5.0)
    reply = zoobench("render", SPEC.key()[:8], "-o", "run.png", "--width", 640)
    assert (reply.code, reply.out) == (0, "run.png\n"), reply.err
    assert "and error 5 m is stored" in reply.err
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["iterations", "-o", "run.mp4"], "A strip is a picture, and run.mp4 is none. Let it end in .png."),
        (["iterations", "-o", "run.png"], "The body of this run is given, caterpillar"),
        (["everything", "-o", "run.png"], "'everything' is not one of"),
    ],
)
def test_a_strip_that_cannot_be_drawn_is_refused(
    zoobench: Command, tmp_path: Path, words: list[str], message: str
) -> None:
    """Another kind of file, a body that never changed, and a strip of nothing known; no file is left."""
    needs_drawing()
    stored(tmp_path / "zoobench.db", 0.5, FinalRow("iterations", 2.0))
    reply = zoobench("render", "1", "--strip", *words)
    assert reply.code == 2
    assert message in " ".join(reply.err.replace("│", " ").split())
    assert not list(tmp_path.glob("run.*"))


@pytest.mark.slow
def test_a_gait_is_drawn(zoobench: Command, tmp_path: Path) -> None:
    """From the parameters that are stored."""
    needs_drawing()
    stored(tmp_path / "zoobench.db", 0.5)
    reply = zoobench("render", "1", "--strip", "gait", "-o", "gait.png")
    assert (reply.code, reply.out) == (0, "gait.png\n"), reply.err
    assert (tmp_path / "gait.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("run", "message"),
    [
        ("1", "kept no solutions. Do it again with: zoobench run"),
        ("9", "Run 9 is diverged and has no solution. `zoobench show 9 --log`"),
        ("10", "Run 10 is failed and has no solution"),
        ("11", "Run 11 is running and has no solution yet"),
        ("12", "Run 12 is queued and has no solution yet"),
        ("99", "No run matches '99'"),
    ],
)
def test_a_run_without_a_solution_says_why(
    zoobench: Command, database: Path, tmp_path: Path, run: str, message: str
) -> None:
    """Exit code 2, and no file."""
    reply = zoobench("render", run, "-o", "run.npz")
    assert (reply.code, reply.out) == (2, "")
    assert message in reply.err
    assert not (tmp_path / "run.npz").exists()
