"""Files that are replaced as wholes."""

from pathlib import Path

import pytest

from zoobench.files import replace_files


def test_files_are_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    """One that was there, and one that was not."""
    (tmp_path / "old").write_text("before")
    new = tmp_path / "folder" / "new"
    replace_files({tmp_path / "old": b"after", new: b"first"})
    assert {path.name: path.read_text() for path in (tmp_path / "old", new)} == {"old": "after", "new": "first"}
    assert {path for path in tmp_path.rglob("*") if path.is_file()} == {tmp_path / "old", new}


def test_if_one_cannot_be_written_all_stay_as_they_were(tmp_path: Path) -> None:
    """A file is where its folder should be."""
    (tmp_path / "old").write_text("before")
    with pytest.raises(OSError, match="old"):
        replace_files({tmp_path / "old": b"after", tmp_path / "old" / "new": b"first"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"old": "before"}
