"""A hook of the build: the commit that a wheel or source distribution is built from goes into it."""

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TARGET = "zoobench/commit.json"


class CommitHook(BuildHookInterface[Any]):
    """Writes `zoobench/commit.json`, which `zoobench.harness.provenance` reads; not into the checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file, where there is a checkout and the package is not installed as an editable one."""
        root = Path(self.root)
        if version == "editable" or not (root / ".git").exists():
            return  # what runs from its checkout is asked there; a source distribution has the file already
        commit = _git(root, "rev-parse", "HEAD")
        if commit is None:
            return
        changes = _git(root, "status", "--porcelain", "--", "zoobench")
        self._folder = tempfile.TemporaryDirectory()
        file = Path(self._folder.name) / "commit.json"
        file.write_text(json.dumps({"commit": commit, "dirty": bool(changes)}))
        build_data["force_include"][str(file)] = TARGET


def _git(root: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None
