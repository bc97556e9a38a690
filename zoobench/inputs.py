"""Parameters that refer to a file, `body.stl@sha256-1f3a0c...`, or to a stored run, `run-1f3a0c5d7e9b2a46`.

A run is identified by a key made of its settings. They therefore contain the digest of a file's content and the key of
a stored run, which do not depend on folder or database. A file that changed after its name was pinned is refused; its
name without digest makes a new run.
"""

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from zoobench.errors import UsageError
from zoobench.files import read_whole
from zoobench.spec import Ref, RunSpec

_DIGITS = 16  # 64 bits: unique in practice, short enough for a table


class InputFile(str):
    """Annotation of a parameter that names a file; a subclass has the `endings` that it may have, as in `.stl`."""

    __slots__ = ()
    endings: ClassVar[tuple[str, ...]] = ()


NO_FILE = InputFile("")

_MARK = "@sha256-"


def pin(name: str, endings: tuple[str, ...] = ()) -> str:
    """The name with the digest of the file's content; a name with a digest is returned unchanged.

    Args:
        endings: that the file may have; any if there are none.

    Raises:
        UsageError: the file cannot be read, has another ending, or its name contains reserved characters.
    """
    if _MARK in name:
        return name
    if any(sign in name for sign in ",[]="):
        raise UsageError(f"The file name {name!r} cannot be a setting: it contains one of , [ ] =. Rename the file.")
    return f"{name}{_MARK}{_digest(read_whole(Path(name), endings=endings))}"


def path_of(pinned: str) -> Path:
    """The path, without the digest."""
    return Path(pinned.partition(_MARK)[0])


def read(name: str) -> bytes:
    """The content of a file, given with or without digest.

    Raises:
        UsageError: the file cannot be read, or has another digest.
    """
    path, _, digest = name.partition(_MARK)
    content = read_whole(Path(path))
    if digest and _digest(content) != digest:
        raise UsageError(
            f"The file {path!r} has changed: its sha256 begins with {_digest(content)}, {digest} was expected. "
            f"Restore the old file, or give its name without {_MARK}... to make a new run."
        )
    return content


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


_RUN_MARK = "run-"
_RUN_NAME = re.compile(f"{_RUN_MARK}[0-9a-f]{{{_DIGITS}}}")


class StoredRun(str):
    """Annotation of a parameter that names a stored run: a method's, for a warm start, or one of a stored gait or body.

    An empty default is not part of a run's key. A method need not use the parameter: `Problem.initial` does.
    """

    __slots__ = ()


FROM_NONE = StoredRun("")


@dataclass(frozen=True)
class Start:
    """The solution of a stored run.

    Attributes:
        spec: of that run.
        params: `[parameter_count]`.
        milestones: its best parameters after some of its iterations, the earliest first.
    """

    spec: RunSpec
    params: tuple[float, ...]
    milestones: tuple[tuple[float, ...], ...] = ()


def run_name(key: str) -> str:
    """The name of the run with this key in a setting."""
    return f"{_RUN_MARK}{key[:_DIGITS]}"


def checked_run_name(name: str) -> str:
    """The name unchanged, if it is empty or of the form that `run_name` gives.

    Raises:
        UsageError: it is neither.
    """
    if name and not _RUN_NAME.fullmatch(name):
        raise UsageError(
            f"{name!r} names no stored run. Write {_RUN_MARK} and the first {_DIGITS} digits of the run's key; "
            "`zoobench run` also accepts a run's number."
        )
    return name


def named_run(method: Ref) -> str:
    """The beginning of the key of the run from which a method starts; empty without a warm start."""
    names = (value for _, value in method.params if isinstance(value, str) and _RUN_NAME.fullmatch(value))
    return next(names, "").removeprefix(_RUN_MARK)


def named_runs(*refs: Ref) -> list[str]:
    """The beginnings of the keys of all runs that references name, also several in a parameter, each once."""
    names = (name for ref in refs for name in re.findall(rf"[=+]{_RUN_NAME.pattern}(?=[],+])", str(ref)))
    return list(dict.fromkeys(name[1:].removeprefix(_RUN_MARK) for name in names))


Finder = Callable[[str], Start | None]
"""Gives the solution of the run of this name; None if there is none."""


def _nowhere(name: str) -> Start | None:
    return None


_find: Finder = _nowhere
_known: dict[str, Start] = {}


def find_with(finder: Finder) -> None:
    """Say where `solution_in` finds stored runs: in a database, or among those that a process was given."""
    global _find
    _find = finder


def make_known(name: str, start: Start) -> None:
    """Let `solution_in` find a solution by this name of its run, where no database or process has one of that name."""
    _known[name] = start


def solution_in(name: str) -> Start:
    """The solution of the run of this name, for the component that names it.

    Raises:
        UsageError: there is none; StorageError: it cannot be read.
    """
    found = _find(checked_run_name(name)) or _known.get(name)
    if found is None:
        raise UsageError(f"{name or 'No run'} is not in this database and done. Do that run first, or choose another.")
    return found
