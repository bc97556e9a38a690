"""Files that a run depends on, known by name and content: `body.stl@sha256-1f3a0c...`.

A run is known by a key made of its settings. A file's name says nothing about what is in it, so the registry pins every
parameter of type `InputFile`: the digest becomes part of the setting, and of the key. What was run stays what it was:
if the file changes, the pinned one is refused, and the bare name makes a new run.
"""

import hashlib
from pathlib import Path

from zoobench.errors import UsageError


class InputFile(str):
    """The type of a parameter that names a file, to annotate it with."""

    __slots__ = ()


_MARK = "@sha256-"
_DIGITS = 16  # 64 bits: enough to tell files apart, short enough for a table


def pin(name: str) -> str:
    """The name with the digest of the file's bytes; a name that is pinned already stays as it is.

    Raises:
        UsageError: the file cannot be read, or its name cannot stand in a setting.
    """
    if _MARK in name:
        return name
    if any(sign in name for sign in ",[]="):
        raise UsageError(f"The file name {name!r} holds one of the signs , [ ] = and cannot be a setting. Rename it.")
    return f"{name}{_MARK}{_digest(_bytes(name))}"


def path_of(pinned: str) -> Path:
    """The path, without the digest."""
    return Path(pinned.partition(_MARK)[0])


def read(name: str) -> bytes:
    """What is in a file, pinned or not.

    Raises:
        UsageError: it cannot be read, or is not what was pinned.
    """
    path, _, digest = name.partition(_MARK)
    content = _bytes(path)
    if digest and _digest(content) != digest:
        raise UsageError(
            f"The file {path!r} is not the one that was meant: its sha256 begins with {_digest(content)}, {digest} was "
            f"expected. Put the old file back, or name it without {_MARK}... to make a new run."
        )
    return content


def _bytes(path: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise UsageError(f"The file {path!r} cannot be read: {error.strerror or error}. Check the name.") from None


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]
