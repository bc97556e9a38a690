"""Settings that stand for more than they say: a file, `body.stl@sha256-1f3a0c...`, or a run, `run-1f3a0c5d7e9b2a46`.

A run is known by a key made of its settings. A file's name says nothing about its content, and a run's number in one
database says nothing in another. So a setting names a file by the digest of its bytes and a run by its key, and both
become part of the key of the run that uses them. A file that changed after it was pinned is refused, and its bare name
makes a new run.
"""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from zoobench.errors import UsageError
from zoobench.spec import Ref, RunSpec

_DIGITS = 16  # 64 bits: enough to tell files and runs apart, short enough for a table


class InputFile(str):
    """The type of a parameter that names a file, to annotate it with."""

    __slots__ = ()


_MARK = "@sha256-"


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


_RUN_MARK = "run-"
_RUN_NAME = re.compile(f"{_RUN_MARK}[0-9a-f]{{{_DIGITS}}}")


class StoredRun(str):
    """The type of a method's parameter that names a stored run, to annotate it with.

    It is empty by default, which is no part of a run's key. A method needs to do nothing with it: where it is given,
    the first draw begins there.
    """

    __slots__ = ()


FROM_NONE = StoredRun("")


@dataclass(frozen=True)
class Start:
    """What a stored run has found.

    Attributes:
        spec: of that run.
        params: its solution `[parameter_count]`.
    """

    spec: RunSpec
    params: tuple[float, ...]


def run_name(key: str) -> str:
    """The name of the run with this key, as a setting has it."""
    return f"{_RUN_MARK}{key[:_DIGITS]}"


def checked_run_name(name: str) -> str:
    """The name of a stored run as it is, or the empty one.

    Raises:
        UsageError: it is not of the form that `run_name` gives.
    """
    if name and not _RUN_NAME.fullmatch(name):
        raise UsageError(
            f"{name!r} names no stored run. A setting has {_RUN_MARK} and the first {_DIGITS} digits of the run's "
            "key; `zoobench run` makes it of a number."
        )
    return name


def named_run(method: Ref) -> str:
    """The beginning of the key of the run that a method is to start from; empty if from none."""
    names = (value for _, value in method.params if isinstance(value, str) and _RUN_NAME.fullmatch(value))
    return next(names, "").removeprefix(_RUN_MARK)
