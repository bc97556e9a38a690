"""Files that are replaced as wholes."""

import multiprocessing
from pathlib import Path

import pytest

from zoobench.files import replace_files


def test_files_are_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    """One that existed, and one that did not."""
    (tmp_path / "old").write_text("before")
    replace_files({tmp_path / "old": b"after", tmp_path / "new": b"first"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"old": "after", "new": "first"}


def test_if_one_cannot_be_written_all_stay_as_they_were(tmp_path: Path) -> None:
    """Its folder is missing."""
    (tmp_path / "old").write_text("before")
    with pytest.raises(OSError, match="No such file"):
        replace_files({tmp_path / "old": b"after", tmp_path / "nowhere" / "new": b"first"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"old": "before"}


def test_missing_folders_are_made_only_if_asked_for(tmp_path: Path) -> None:
    """Those on the way too."""
    path = tmp_path / "a" / "b" / "new"
    with pytest.raises(OSError, match="No such file"):
        replace_files({path: b"content"})
    replace_files({path: b"content"}, make_folders=True)
    assert path.read_bytes() == b"content"


def _write_often(path: Path, letter: bytes) -> None:
    for _ in range(200):
        replace_files({path: 10_000 * letter})


def test_processes_that_write_one_file_do_not_mix(tmp_path: Path) -> None:
    """The file is complete at any time, of the one or the other, and none fails."""
    path = tmp_path / "shared"
    _write_often(path, b"a")
    context = multiprocessing.get_context("spawn")
    writers = [context.Process(target=_write_often, args=(path, letter)) for letter in (b"a", b"b")]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        assert path.read_bytes() in (10_000 * b"a", 10_000 * b"b")
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert [item.name for item in tmp_path.iterdir()] == ["shared"]
