"""The command line in this process, with what it says on both streams."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import pytest
import typer

from tests.harness.helpers import fake
from tests.report.content import fill
from zoobench.cli.main import main
from zoobench.harness import worker_pool

ROOT = Path(__file__).parents[2]
_get_command = cache(typer.main.get_command)
real_run_all = worker_pool.run_all


@dataclass(frozen=True)
class Reply:
    """What a command gave back."""

    code: int
    out: str
    err: str


Command = Callable[..., Reply]


@pytest.fixture
def zoobench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Command:
    """Run a command line in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ZOOBENCH_DB", raising=False)
    # typer makes all commands of an app anew for each line, which a process has one of
    monkeypatch.setattr(typer.main, "get_command", _get_command)

    def run(*words: object) -> Reply:
        try:
            code = main([str(word) for word in words])
        except SystemExit as ending:
            code = ending.code if isinstance(ending.code, int) else 0
        captured = capfd.readouterr()
        return Reply(code, captured.out, captured.err)

    return run


@pytest.fixture
def database(tmp_path: Path) -> Path:
    """The database of `tests.report.content.fill`, under the name that commands look for."""
    return fill(tmp_path / "zoobench.db")


@pytest.fixture
def pretend(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Choose how the fake child behaves."""

    def choose(mode: str = "steady", **options: float) -> None:
        child = fake(mode, **options)  # type: ignore[arg-type]
        monkeypatch.setattr(worker_pool, "run_all", partial(real_run_all, child=child))
        monkeypatch.setenv("PYTHONPATH", str(ROOT))

    return choose
