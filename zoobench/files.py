"""Atomic replacement of files, since an existing file may be the only copy."""

import secrets
from collections.abc import Mapping
from pathlib import Path


def replace_files(contents: Mapping[Path, bytes], *, make_folders: bool = False) -> None:
    """Write these files beside their places, and rename them once all are complete.

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
