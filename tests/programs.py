"""Programs in processes of their own."""

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path


def run(
    *words: object, cwd: Path, environ: Mapping[str, str] | None = None, timeout: float = 300.0
) -> subprocess.CompletedProcess[str]:
    """What `python WORDS` does in a folder; as `subprocess.run`.

    Args:
        environ: settings beside those of this process.
        timeout: the process is killed after it [s].
    """
    command = (sys.executable, *map(str, words))
    settings = {**os.environ, **(environ or {})}
    return subprocess.run(command, cwd=cwd, env=settings, capture_output=True, text=True, check=False, timeout=timeout)
