"""Bodies from users' files on the command line."""

from pathlib import Path

from tests.cli.conftest import Command
from tests.designs.meshes import fish


def test_plan_and_show_say_what_was_made_of_a_file(zoobench: Command) -> None:
    """Repairs, directions and thin parts, at the fidelity of the run and of the card."""
    fish(open_ends=True).export("a.stl")
    words = ("run", "--dry-run", "--env", "ground", "--task", "turning", "--fidelity", "draft", "--seeds", "1")
    reply = zoobench(*words, "--design", "mesh[path=a.stl,up=auto]")
    assert reply.code == 0
    for said in (
        "its unit is not known, so it was scaled by 0.001 to a length of 0.1 m",
        "mesh: In the file, x was taken",
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


def test_a_device_is_refused_as_a_body(zoobench: Command) -> None:
    """By its ending, or as no regular file behind a link, before it is read."""
    Path("a.stl").symlink_to("/dev/zero")
    for name, fault in (("/dev/zero", "Give a file that ends in"), ("a.stl", "Give a regular file")):
        reply = zoobench("show", f"mesh[path={name}]")
        assert (reply.code, fault in reply.err) == (2, True)
