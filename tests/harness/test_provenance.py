"""Provenance says where a number comes from, and stays the same while that does."""

import json
import os
import runpy
import subprocess
import sys
import zipfile
from importlib.metadata import packages_distributions, version
from pathlib import Path

import pytest

from tests.test_architecture import ROOT, imports_of
from zoobench import registry, rounding
from zoobench.db import published
from zoobench.harness import provenance

IDENTITY = ("-c", "user.name=n", "-c", "user.email=e@example.org")


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
    for command in (["init", "-q"], ["add", "."], [*IDENTITY, "commit", "-qm", "first"]):
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


def test_what_was_built_from_a_checkout_tells_its_commit(tmp_path: Path) -> None:
    """As `hatch_build.py` writes it into a wheel; without that no commit is known."""
    (tmp_path / "a.py").write_text("x = 1\n")
    assert provenance._code(tmp_path)["commit"] is None
    (tmp_path / "commit.json").write_text('{"commit": "0123", "dirty": true}')
    code = provenance._code(tmp_path)
    assert (code["commit"], code["dirty"], len(code["files"])) == ("0123", True, 64)


def test_the_build_writes_the_commit(tmp_path: Path) -> None:
    """The hook gives the file of a checkout to the wheel, and nothing to an editable installation."""
    hook = runpy.run_path(str(ROOT / "hatch_build.py"))["BuildHook"]
    for command in (["init", "-q"], [*IDENTITY, "commit", "-q", "--allow-empty", "-m", "first"]):
        subprocess.run(["git", "-C", str(tmp_path), *command], check=True)
    for kind, count in (("standard", 1), ("editable", 0)):
        data: dict[str, dict[str, str]] = {"force_include": {}}
        made = hook(str(tmp_path), {}, None, None, "", "wheel")
        made.initialize(kind, data)
        assert len(data["force_include"]) == count
        for file, target in data["force_include"].items():
            assert target == "zoobench/commit.json"
            assert len(json.loads(Path(file).read_text())["commit"]) == 40


@pytest.mark.slow
@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not a checkout")
def test_what_runs_from_a_wheel_names_the_commit_and_has_the_best_solutions(tmp_path: Path) -> None:
    """Built from this checkout and unpacked elsewhere, it gives the commit and leaderboards that it was built from."""
    from hatchling.builders.wheel import WheelBuilder

    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["standard"])
    site = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(site)
    code = (
        "import json; from zoobench.db import published; from zoobench.harness import provenance; "
        "print(json.dumps([provenance.gather()['code'], str(published.folder()), published.names()]))"
    )
    environ = {**os.environ, "PYTHONPATH": str(site)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, cwd=tmp_path, env=environ, check=True)
    head = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    found, folder, names = json.loads(done.stdout)
    assert found["commit"] == head.stdout.strip()
    assert (folder, names) == (str(site / "zoobench" / "leaderboards"), published.names())
    assert names


def test_every_library_that_makes_numbers_is_named() -> None:
    """A package that simulates, optimises or stores imports no distribution that the provenance leaves out."""
    folders = ("sim", "designs", "envs", "tasks", "controllers", "cell", "methods", "gym", "db")
    imported = {
        name.partition(".")[0]
        for folder in folders
        for path in (ROOT / "zoobench" / folder).rglob("*.py")
        for name in imports_of(path)
    }
    known = packages_distributions()
    distributions = {known[name][0].lower().replace("_", "-") for name in imported & known.keys()}
    without_numbers = {"typing-extensions", "pyarrow"}  # files for other programs
    assert distributions - without_numbers <= {name.lower() for name in provenance.PACKAGES}
    assert {"cma", "neat-python", "ribs", "stable-baselines3", "gymnasium", "roma", "scipy"} <= distributions


def test_a_plug_in_in_a_checkout_has_its_name_and_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`pip install -e` lists none of its modules; its entry point tells whose they are."""
    info = tmp_path / "zoo_climb-0.3.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: zoo-climb\nVersion: 0.3\n")
    (info / "RECORD").write_text("__editable__.zoo_climb-0.3.pth,,\n")
    (info / "entry_points.txt").write_text("[zoobench.methods]\nclimb = zoo_climb.method\n")
    monkeypatch.syspath_prepend(tmp_path)
    registry._entry_points.cache_clear()
    try:
        assert provenance._distribution_of("zoo_climb") == {"distribution": "zoo-climb", "version": "0.3"}
    finally:
        registry._entry_points.cache_clear()
