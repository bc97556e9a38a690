"""The shape of the house: who may import whom, who may import Taichi, and how long a file may be."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "zoobench"
FILES = sorted(PACKAGE.rglob("*.py"))
LONGEST_FILE = 500

# What each room must not import, anywhere in its files: not even inside a function.
FORBIDDEN = {
    "db": {"sim", "cli", "harness", "report", "studies", "problem", "methods"},
    "report": {"sim", "cli", "harness", "studies", "problem", "methods"},
    "harness": {"sim", "cli", "report", "studies"},
    "studies": {"cli", "report", "harness"},
    "envs": {"cli", "harness", "db", "report", "studies", "problem", "methods", "tasks", "controllers"},
    "tasks": {"cli", "harness", "db", "report", "studies", "problem", "methods", "envs", "controllers", "sim"},
    "designs": {"cli", "harness", "db", "report", "studies", "problem", "methods", "tasks", "controllers"},
    "controllers": {"cli", "harness", "db", "report", "studies", "problem", "methods", "envs", "tasks", "sim"},
    "methods": {"cli", "harness", "db", "report", "studies", "sim", "envs", "tasks", "designs", "controllers"},
    "gym": {"cli", "harness", "db", "report", "studies", "methods", "sim"},
    "session": {"cli", "harness", "db", "report", "studies", "methods", "gym", "controllers", "designs", "envs"},
    "problem": {"cli", "harness", "db", "report", "studies", "methods", "gym"},
    "robot": {"cli", "harness", "db", "report", "studies", "methods", "problem", "envs"},
    "spec": {"cli", "harness", "db", "report", "studies", "methods", "problem", "sim", "registry"},
    "cli": {"sim", "problem", "methods", "envs", "tasks", "designs", "controllers"},
}


def room_of(path: Path) -> str:
    """The package or top-level module that a file belongs to."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return parts[0]


def imports_of(path: Path) -> Iterator[str]:
    """Every module that a file imports, at any depth, as a dotted name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide the direction of a dependency"
            assert node.module is not None
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def rooms_used_by(path: Path) -> set[str]:
    """The rooms of ours that a file imports from."""
    names = (name.split(".") for name in imports_of(path))
    return {parts[1] for parts in names if parts[0] == "zoobench" and len(parts) > 1}


def label(path: Path) -> str:
    """A file's name in the test report."""
    return path.relative_to(PACKAGE).as_posix()


@pytest.mark.parametrize("path", [path for path in FILES if room_of(path) == "sim"], ids=label)
def test_the_simulator_knows_nothing_of_ours_but_errors(path: Path) -> None:
    """Physics knows no tasks, robots' goals, databases or command line."""
    assert rooms_used_by(path) <= {"sim", "errors"}


@pytest.mark.parametrize("path", [path for path in FILES if room_of(path) in FORBIDDEN], ids=label)
def test_dependencies_point_one_way(path: Path) -> None:
    """No room imports from a room that stands above it."""
    assert not rooms_used_by(path) & FORBIDDEN[room_of(path)]


@pytest.mark.parametrize("path", [path for path in FILES if room_of(path) != "sim"], ids=label)
def test_only_the_simulator_imports_taichi(path: Path) -> None:
    """A port to another engine touches one room."""
    assert "taichi" not in {name.partition(".")[0] for name in imports_of(path)}


@pytest.mark.parametrize("path", [path for path in FILES if room_of(path) != "db"], ids=label)
def test_only_the_database_room_imports_sqlalchemy(path: Path) -> None:
    """SQL stays in one room."""
    assert not {name.partition(".")[0] for name in imports_of(path)} & {"sqlalchemy", "alembic"}


@pytest.mark.parametrize("path", FILES, ids=label)
def test_click_is_never_imported(path: Path) -> None:
    """Typer brings a copy of its own, so there may be none to import."""
    assert "click" not in {name.partition(".")[0] for name in imports_of(path)}


@pytest.mark.parametrize("path", FILES, ids=label)
def test_files_stay_short(path: Path) -> None:
    """A file that reaches 500 lines is to be split."""
    assert len(path.read_text(encoding="utf-8").splitlines()) < LONGEST_FILE


def test_the_scan_sees_imports_inside_functions(tmp_path: Path) -> None:
    """The checks above would find a hidden import."""
    path = tmp_path / "hidden.py"
    path.write_text("def f():\n    from zoobench import sim\n    import zoobench.db.store\n")
    assert rooms_used_by(path) == {"sim", "db"}
