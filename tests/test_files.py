"""Files that are read and replaced as wholes."""

import multiprocessing
import os
from pathlib import Path

import pytest

from zoobench.errors import UsageError
from zoobench.files import cache_folder, hash_of_sources, read_whole, replace_files


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


@pytest.mark.parametrize("kind", ["device", "pipe", "folder", "link to a device"])
def test_only_regular_files_are_read(kind: str, tmp_path: Path) -> None:
    """Others are refused before they are opened: a device may have no end, and a pipe may wait for ever."""
    path = tmp_path / "a.stl"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero")
    with pytest.raises(UsageError, match="Give a regular file"):
        read_whole(Path("/dev/zero") if kind == "device" else path)


def test_a_file_is_read_up_to_a_size(tmp_path: Path) -> None:
    """A larger one is refused by its size, also if it does not know it, as those of the kernel."""
    (tmp_path / "a").write_bytes(b"12345")
    assert read_whole(tmp_path / "a", most=5) == b"12345"
    with pytest.raises(UsageError, match=r"has 5 bytes\. Give a file of 4 bytes at most"):
        read_whole(tmp_path / "a", most=4)
    with pytest.raises(UsageError, match="goes on beyond 10 bytes"):
        read_whole(Path("/proc/self/status"), most=10)


def test_the_ending_is_checked_first(tmp_path: Path) -> None:
    """In any case of its letters, before the file is looked at."""
    (tmp_path / "a.STL").write_bytes(b"x")
    assert read_whole(tmp_path / "a.STL", endings=(".stl",)) == b"x"
    with pytest.raises(UsageError, match=r"ends in '.iso'. Give a file that ends in .stl, .obj or .ply"):
        read_whole(tmp_path / "nowhere.iso", endings=(".stl", ".obj", ".ply"))
    with pytest.raises(UsageError, match="cannot be read"):
        read_whole(tmp_path / "nowhere.stl", endings=(".stl",))


def test_the_hash_of_sources_is_of_names_and_contents(tmp_path: Path) -> None:
    """A module that changes, moves or is added changes it; other files and folders left out do not."""
    (tmp_path / "cli").mkdir()
    (tmp_path / "one.py").write_text("1")
    found = [hash_of_sources(tmp_path, leave_out=("cli",))]
    (tmp_path / "cli" / "command.py").write_text("2")
    (tmp_path / "data.csv").write_text("3")
    assert hash_of_sources(tmp_path, leave_out=("cli",)) == found[0]
    found.append(hash_of_sources(tmp_path))
    (tmp_path / "one.py").write_text("2")
    found.append(hash_of_sources(tmp_path))
    (tmp_path / "one.py").rename(tmp_path / "two.py")
    found.append(hash_of_sources(tmp_path))
    assert len(set(found)) == 4


def test_cache_folder_follows_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """ZOOBENCH_CACHE first, then the user's cache folder."""
    monkeypatch.setenv("ZOOBENCH_CACHE", "/a")
    assert cache_folder() == Path("/a")
    monkeypatch.delenv("ZOOBENCH_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", "/b")
    assert cache_folder() == Path("/b/zoobench")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", "/c")
    assert cache_folder() == Path("/c/.cache/zoobench")
