"""Files that are replaced as wholes: what is there may be the only copy, and another process may be reading it."""

from collections.abc import Mapping
from pathlib import Path
from uuid import uuid4


def replace_files(contents: Mapping[Path, bytes]) -> None:
    """Write these files beside their places and rename them only when all are whole; folders on the way are made.

    Raises:
        OSError: a file cannot be written; those that were there are as they were.
    """
    parts = {path: path.with_name(f"{path.name}.{uuid4().hex}.part") for path in contents}
    try:
        for path, part in parts.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(contents[path])
        for path, part in parts.items():
            part.replace(path)
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)
