"""Files that are read and replaced as wholes, of which only regular ones of a bounded size are read, and the cache."""

import hashlib
import os
import secrets
import stat
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from zoobench.errors import UsageError, reason

MOST_BYTES = 1 << 28
"""Largest size of a file that is read into memory [bytes]: a mesh of five million triangles."""


def cache_folder() -> Path:
    """The folder of files that can be made again: `ZOOBENCH_CACHE`, else in the user's cache folder."""
    if chosen := os.environ.get("ZOOBENCH_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "zoobench"


def read_whole(path: Path, *, endings: Sequence[str] = (), most: int = MOST_BYTES) -> bytes:
    """The content of a regular file; devices, pipes and folders are refused before they are opened.

    Args:
        endings: that the name may have, in lower case as in `.stl`; any if there are none.
        most: bytes that the file may have.

    Raises:
        UsageError: it has another ending, is not a regular file, is too large, or cannot be read.
    """
    if endings and path.suffix.lower() not in endings:
        raise UsageError(
            f"{path.name!r} ends in {path.suffix!r}. Give a file that ends in {', '.join(endings[:-1])}"
            f"{' or ' if endings[1:] else ''}{endings[-1]}."
        )
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise UsageError(f"{str(path)!r} is a folder, a device or a pipe. Give a regular file.")
        if found.st_size > most:
            raise UsageError(f"{str(path)!r} has {found.st_size:,} bytes. Give a file of {most:,} bytes at most.")
        with path.open("rb") as file:
            content = file.read(most + 1)  # a file may grow, or not know its size
    except (OSError, ValueError) as error:
        words = reason(error) if isinstance(error, OSError) else str(error)
        raise UsageError(f"The file {str(path)!r} cannot be read: {words}. Check the name.") from None
    if len(content) > most:
        raise UsageError(f"{str(path)!r} goes on beyond {most:,} bytes. Give a smaller file.")
    return content


def replace_files(contents: Mapping[Path, bytes], *, make_folders: bool = False) -> None:
    """Write these files under temporary names in their folders, and rename them once all are complete.

    Several processes may write the same file: the last one wins, and no reader sees a part of one.

    Args:
        make_folders: make the folders that are missing.

    Raises:
        OSError: a file cannot be written; those that existed are unchanged.
    """
    parts = {path: path.with_name(f"{path.name}.{secrets.token_hex(8)}.part") for path in contents}
    try:
        for path, part in parts.items():
            if make_folders:
                path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(contents[path])
        for path, part in parts.items():
            part.replace(path)
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)


def hash_of_sources(package: Path, *, leave_out: Collection[str] = ()) -> str:
    """The sha256 of the names and contents of a package's modules, as of now.

    Args:
        package: its folder.
        leave_out: folders in it that do not count.
    """
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        if (name := path.relative_to(package)).parts[0] not in leave_out:
            digest.update(name.as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
