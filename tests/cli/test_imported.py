"""Bodies from users' files on the command line."""

from pathlib import Path

from tests.cli.conftest import Command
from tests.designs.meshes import fish


def test_plan_and_show_say_what_was_made_of_a_file(zoobench: Command) -> None:
    """Repairs, directions and thin parts, at the fidelity of the run and of the card."""
    fish(open_ends=True).export("a.stl")
    words = ("plan", "--env", "ground", "--task", "turning", "--fidelity", "draft", "--seeds", "1")
    reply = zoobench(*words, "--design", "mesh[path=a.stl,up=auto]")
    assert reply.code == 0
    for said in (
        "mesh: Of the file's directions, x was taken",
        "mesh: The mesh was open: 2 holes",
    ):
        assert said in reply.err


def test_a_body_that_cannot_be_made_is_refused_before_anything_runs(zoobench: Command) -> None:
    """Exit code 2, and no run is in the database."""
    fish().export("a.stl")
    words = (
        "run",
        "--env",
        "ground",
        "--task",
        "turning",
        "--fidelity",
        "draft",
        "--design",
        "mesh[path=a.stl,length=0.03]",
    )
    reply = zoobench(*words)
    assert reply.code == 2
    assert "is too thin for a grid spacing of 0.01562 m: 100 % of its volume" in reply.err
    assert not Path("zoobench.db").exists() or "0 runs" in zoobench("status").out
