"""Files that are replaced as wholes."""

from pathlib import Path

import pytest

from zoobench.files import replace_files


def test_files_are_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    """One that was there, and one that was not."""
    (tmp_path / "old").write_text("before")
    replace_files({tmp_path / "old": b"after", tmp_path / "new": b"first"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"old": "after", "new": "first"}


def test_if_one_cannot_be_written_all_stay_as_they_were(tmp_path: Path) -> None:
    """Its folder is missing."""
    (tmp_path / "old").write_text("before")
    with pytest.raises(OSError, match="No such file"):
        replace_files({tmp_path / "old": b"after", tmp_path / "nowhere" / "new": b"first"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"old": "before"}
