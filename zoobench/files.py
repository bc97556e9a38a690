"""Files that are replaced as wholes: what is there already may be the only copy."""

from collections.abc import Mapping
from pathlib import Path


def replace_files(contents: Mapping[Path, bytes]) -> None:
    """Write these files beside their places and rename them only when all are whole.

    Raises:
        OSError: a file cannot be written; those that were there are as they were.
    """
    parts = {path: path.with_name(f"{path.name}.part") for path in contents}
    try:
        for path, part in parts.items():
            part.write_bytes(contents[path])
        for path, part in parts.items():
            part.replace(path)
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)
