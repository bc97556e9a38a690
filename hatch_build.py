"""A hook of the build: what a wheel holds beside the package, its commit and the leaderboards."""

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TARGET = "zoobench/commit.json"


class BuildHook(BuildHookInterface[Any]):
    """Adds what a checkout has beside the package.

    Those are `zoobench/commit.json`, which `zoobench.harness.provenance` reads, and the exports of the leaderboards,
    whose best solutions `zoobench.db.published` reads; nothing is written into the checkout.
    """

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the files, where the package is not installed as an editable one, and the commit of a checkout."""
        root = Path(self.root)
        if version == "editable":
            return  # what runs from its checkout looks there
        if self.target_name == "wheel":
            for export in sorted((root / "leaderboards").glob("*.json")):
                build_data["force_include"][str(export)] = f"zoobench/leaderboards/{export.name}"
        if not (root / ".git").exists():
            return  # a source distribution has the file already
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
