"""Packages that `zoobench new` writes: they install, pass their own tests, and those tests find what is wrong."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests import programs
from tests.test_plugins import build
from zoobench import registry
from zoobench.errors import UsageError
from zoobench.plugins.package import OFFERED, write_package
from zoobench.registry import Kind


def name_of(kind: Kind) -> str:
    """The name of the component that is made of this kind."""
    return f"my-{kind.noun}"


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a package of every kind."""
    folder = tmp_path_factory.mktemp("packages")
    for kind in OFFERED:
        write_package(kind, name_of(kind), folder)
    return folder


@pytest.fixture(scope="module")
def site(packages: Path) -> Path:
    """A folder with all of them installed by pip, with the entry points of their `pyproject.toml`."""
    target = packages / "site"
    wheels = []
    for package in sorted(packages.glob("zoobench-*")):
        project = tomllib.loads((package / "pyproject.toml").read_text())["project"]
        ((group, points),) = project["entry-points"].items()
        ((name, module),) = points.items()
        source = (package / f"{module}.py").read_text()
        wheels.append(
            build(project["name"].replace("-", "_"), {module: source}, f"[{group}]\n{name} = {module}\n", packages)
        )
    words = ["install", "--quiet", "--no-deps", "--no-index", "--disable-pip-version-check", "--target", target]
    subprocess.run([sys.executable, "-m", "pip", *words, *wheels], check=True, capture_output=True)
    return target


def own_tests(packages: Path, site: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Their tests, in a process that finds them."""
    path = os.pathsep.join([str(site), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = ("-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", packages, *words)
    return programs.run(*command, cwd=packages, environ={"PYTHONPATH": path})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "passed"),
    [
        pytest.param(("-k", "documented or whole or map"), 7, id="cheap"),
        pytest.param((), 14, id="all"),
    ],
)
def test_a_package_of_every_kind_passes_its_own_tests(
    packages: Path, site: Path, words: tuple[str, ...], passed: int
) -> None:
    """As it is written, with the components that the registry finds by their entry points."""
    done = own_tests(packages, site, *words)
    assert done.returncode == 0, done.stdout
    assert f"{passed} passed" in done.stdout


@pytest.mark.slow
def test_its_tests_fail_for_a_component_that_is_wrong(packages: Path, site: Path) -> None:
    """A number without a unit, a parameter without a default, and a method without checkpoints."""
    faults = {
        "zoobench_my_environment.py": ("ground [-].", "ground."),
        "zoobench_my_design.py": ("rows: int = 3)", "rows: int)"),
        "zoobench_my_method.py": ("            keep(problem, context, incumbent)\n", ""),
    }
    sound = {module: (site / module).read_text() for module in faults}
    try:
        for module, (before, after) in faults.items():
            assert before in sound[module]
            (site / module).write_text(sound[module].replace(before, after))
        done = own_tests(packages, site, "-k", "documented or solves")
    finally:
        for module, source in sound.items():
            (site / module).write_text(source)
    assert done.returncode == 1
    for told in ("tells no unit", "has no default", "kept no checkpoint", "3 failed, 3 passed"):
        assert told in done.stdout, done.stdout


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("Odd Name", "kebab-case"),
        ("class", "Python"),
        ("ground", "The environment 'ground' exists already"),
        ("my-environment", "exists already"),
    ],
)
def test_a_name_that_cannot_be_used_is_refused(packages: Path, name: str, advice: str) -> None:
    """Malformed, a word of the language, that of a component, or of a folder; nothing is written."""
    before = sorted(packages.iterdir())
    with pytest.raises(UsageError, match=advice):
        write_package(Kind.ENV, name, packages)
    assert sorted(packages.iterdir()) == before


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    """Here a file is in its place."""
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="Choose another folder"):
        write_package(Kind.TASK, "my-task", tmp_path / "file")


def test_templates_are_in_the_package_and_begin_nothing_here() -> None:
    """Those who write a package get no component by it."""
    assert not [kind for kind in OFFERED if name_of(kind) in registry.names(kind)]
