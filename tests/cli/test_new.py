"""`zoobench new`."""

from pathlib import Path

import pytest

from tests.cli.conftest import Command


@pytest.mark.parametrize("kind", ["env", "environment", "tasks", "design", "controller", "method"])
def test_it_writes_a_package_and_says_what_comes_next(zoobench: Command, tmp_path: Path, kind: str) -> None:
    """The folder on standard output, the commands that install and test it on standard error."""
    reply = zoobench("new", kind, "wet-rock", "--into", tmp_path / "own")
    assert reply.code == 0
    package = tmp_path / "own" / "zoobench-wet-rock"
    assert reply.out.strip() == str(package)
    assert "pip install" in reply.err
    written = {str(path.relative_to(package)) for path in package.rglob("*") if path.is_file()}
    assert written == {"pyproject.toml", "README.md", "zoobench_wet_rock.py", "tests/test_wet_rock.py"}


def test_kinds_have_the_words_of_list(zoobench: Command, tmp_path: Path) -> None:
    """What `zoobench list` takes is taken; a kind that cannot be begun is refused with those that can."""
    reply = zoobench("new", "fidelity", "wet-rock")
    assert reply.code == 2
    assert "envs, " in reply.err
    assert "fidelities" not in reply.err.replace("'fidelity'", "")
    assert not list(tmp_path.iterdir())


def test_a_name_that_is_taken_is_refused(zoobench: Command, tmp_path: Path) -> None:
    """With exit code 2, and nothing is written."""
    reply = zoobench("new", "method", "cmaes")
    assert reply.code == 2
    assert "already" in reply.err
    assert not list(tmp_path.iterdir())
