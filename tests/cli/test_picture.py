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
