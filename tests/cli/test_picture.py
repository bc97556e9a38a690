"""`picture`."""

from pathlib import Path

from tests.cli.conftest import Command
from tests.render.filmed import needs_drawing


def test_picture_prints_the_files_that_it_wrote(zoobench: Command, tmp_path: Path) -> None:
    """One for each environment and the sheet, on standard output alone."""
    needs_drawing()
    reply = zoobench("picture", "--env", "ground,ice", "--fidelity", "smoke", "--out", tmp_path / "made")
    assert reply.code == 0, reply.err
    paths = [Path(line) for line in reply.out.splitlines()]
    assert [path.name for path in paths] == ["ground.png", "ice.png", "environments.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_picture_refuses_what_it_does_not_know(zoobench: Command) -> None:
    """An unknown environment is a usage error that suggests the nearest."""
    reply = zoobench("picture", "--env", "dessert")
    assert (reply.code, "desert" in reply.err) == (2, True)
