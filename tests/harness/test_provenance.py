"""Provenance says where a number comes from, and stays the same while that does."""

import json
import subprocess
from importlib.metadata import version
from pathlib import Path

import pytest

from zoobench import rounding
from zoobench.harness import provenance


def test_it_names_code_packages_and_machine() -> None:
    """The facts that a table's footer needs are there, as JSON."""
    facts = json.loads(json.dumps(provenance.gather()))
    assert facts["packages"]["numpy"] == version("numpy")
    assert len(facts["code"]["files"]) == 64
    assert facts["cpu"]["threads"] >= 1
    assert set(facts["thread_settings"]) == set(provenance.THREAD_VARIABLES)


def test_it_tells_whose_rounding_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user who asks a library for other code than zoobench does leaves a trace of it."""
    monkeypatch.setenv("OPENBLAS_CORETYPE", "SkylakeX")
    monkeypatch.delenv("MKL_CBWR", raising=False)
    told = provenance.gather()["rounding"]
    assert set(told) == set(rounding.CHOICES)
    assert (told["OPENBLAS_CORETYPE"], told["MKL_CBWR"]) == ("SkylakeX", None)


def test_a_changed_file_changes_the_code(tmp_path: Path) -> None:
    """The hash of the package's files follows their contents, checkout or not."""
    (tmp_path / "a.py").write_text("x = 1\n")
    before = provenance._code(tmp_path)
    assert provenance._code(tmp_path) == before
    (tmp_path / "a.py").write_text("x = 2\n")
    assert provenance._code(tmp_path)["files"] != before["files"]


def test_a_checkout_tells_commit_and_uncommitted_changes(tmp_path: Path) -> None:
    """In a git checkout the commit is named, and a change without a commit is marked and hashed."""
    package = tmp_path / "package"
    package.mkdir()
    (package / "a.py").write_text("x = 1\n")
    identity = ["-c", "user.name=n", "-c", "user.email=e@example.org"]
    for command in (["init", "-q"], ["add", "."], [*identity, "commit", "-qm", "first"]):
        subprocess.run(["git", "-C", str(tmp_path), *command], check=True)
    clean = provenance._code(package)
    assert len(clean["commit"]) == 40
    assert clean["dirty"] is False
    (package / "a.py").write_text("x = 2\n")
    changed = provenance._code(package)
    assert changed["commit"] == clean["commit"]
    assert changed["dirty"] is True
    assert len(changed["diff"]) == 64


def test_a_missing_tool_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without git or an NVIDIA driver still has a provenance."""
    monkeypatch.setenv("PATH", "")
    assert provenance._gpus() == []


def test_it_is_gathered_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker that outlives a change of the code tells the new code, which its next child imports."""
    before = provenance.gather()["code"]
    monkeypatch.setattr(provenance, "_code", lambda _: {"files": "changed"})
    assert provenance.gather()["code"] == {"files": "changed"} != before
