"""`run`, also with --dry-run, with real workers and a fake child in the simulator's place."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import create_autospec

import pytest
import torch

from tests.cli.conftest import Command
from tests.report.content import add_done
from zoobench import registry
from zoobench.cli.options import parse_duration
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.harness import engines, ray_pool
from zoobench.harness.grid import expand
from zoobench.harness.request import RunRequest, parse_seeds
from zoobench.spec import RunSelection, RunSpec, repeat_command

CELL = ("--env", "desert", "--task", "turning", "--method", "random")


def states(path: Path) -> list[RunState]:
    """The states of all runs."""
    with Store(path, create=False) as store:
        return [row.state for row in store.runs()]


def test_run_tells_its_plan_and_ends_with_the_next_command(
    zoobench: Command, tmp_path: Path, pretend: Callable[..., None]
) -> None:
    """New, done and skipped are counted, nothing goes to standard output, and the last line can be typed.

    Typed again, the same command has nothing to do; one more seed is one more run.
    """
    pretend()
    reply = zoobench("run", *CELL, "-j", "1")
    assert (reply.code, reply.out) == (0, "")
    lines = reply.err.splitlines()
    assert lines[0] == "2 new, 0 done already, 0 skipped"
    assert any(line.startswith("[2/2] done ") and ", score " in line for line in lines)
    assert lines[-1] == "Next: zoobench table"
    assert states(tmp_path / "zoobench.db") == [RunState.DONE, RunState.DONE]
    assert "0 new, 2 done already" in zoobench("run", *CELL).err
    assert "1 new, 2 done already" in zoobench("run", *CELL, "--seeds", "3", "--no-wait").err


def test_a_policy_for_a_design_space_is_refused_in_the_plan(zoobench: Command, tmp_path: Path) -> None:
    """Nothing of it is queued, as it would fail when it began; that nothing is left is an error."""
    words = ("--env", "ground", "--task", "turning", "--design", "voxel", "--controller", "policy-network")
    for dry in (("--dry-run",), ()):
        reply = zoobench("run", *dry, *words, "--method", "ppo", "--seeds", "1")
        assert "'ppo' needs a body that is given, and the design 'voxel' is a design space" in reply.err
        assert reply.code == 2
        assert "Nothing is left to run" in reply.err
    assert states(tmp_path / "zoobench.db") == [RunState.SKIPPED]


@pytest.mark.parametrize(
    ("method", "library", "others"),
    [
        ("ppo", "stable_baselines3", ("caterpillar", "policy-network")),
        ("quality-diversity", "ribs", ("voxel", "fixed-sine")),
    ],
)
def test_a_method_without_its_extra_is_refused_in_the_plan(
    zoobench: Command, monkeypatch: pytest.MonkeyPatch, method: str, library: str, others: tuple[str, str]
) -> None:
    """With what to install; where it is there, nothing is said."""
    found = registry.find_spec
    words = ("--env", "ground", "--task", "turning", "--method", method, "--seeds", "1")
    cell = ("run", "--dry-run", *words, "--design", others[0], "--controller", others[1])
    assert "not installed" not in zoobench(*cell).err
    monkeypatch.setattr(registry, "find_spec", lambda module: None if module == library else found(module))
    reply = zoobench(*cell)
    assert f"{method!r} needs {library}, which is not installed. Try: pip install 'zoobench[" in reply.err


def test_runs_for_a_gpu_are_refused_where_there_is_none(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is queued; for another machine they can be, each with the device in its fidelity."""
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    reply = zoobench("run", *CELL, "--seeds", "1", "--device", "cuda")
    assert reply.code == 2
    assert "No CUDA device is available" in reply.err
    assert not Path("zoobench.db").exists()
    assert zoobench("run", *CELL, "--seeds", "1", "--device", "cuda", "--no-wait").code == 0
    with Store("zoobench.db", create=False) as store:
        (row,) = store.runs()
    assert row.spec.fidelity.kwargs["device"] == "cuda"
    assert "--fidelity 'draft-v2[" in repeat_command(row.spec)
    assert "device=cuda" in repeat_command(row.spec)


def test_a_device_that_does_not_exist_is_refused(zoobench: Command) -> None:
    """With those that do; a suite states its own."""
    reply = zoobench("run", *CELL, "--device", "tpu")
    assert (reply.code, "Choose one of cpu, cuda" in reply.err) == (2, True)
    reply = zoobench("run", "--suite", "gaits", "--device", "cuda")
    assert (reply.code, "Leave --device out, or --suite" in reply.err) == (2, True)


def test_the_cpu_is_no_other_fidelity(zoobench: Command) -> None:
    """A default that is spelt out names the same run."""
    asked = RunRequest(RunSelection("desert", "turning", method="random"), "1", device="cpu")
    (run,) = asked.cells(":memory:", lambda *_: pytest.fail("no choice"), lambda _: None)
    (other,) = replace(asked, device="").cells(":memory:", lambda *_: pytest.fail("no choice"), lambda _: None)
    assert run == other


def test_water_on_a_grid_is_not_for_a_gpu(zoobench: Command) -> None:
    """The plan says so; water of particles is, and water by forces on the surface."""
    words = ("--task", "turning", "--method", "random", "--seeds", "1", "--device", "cuda")
    assert "'ocean[water=grid]' is full of it" in zoobench("run", "--dry-run", "--env", "ocean[water=grid]", *words).err
    for water in ("particles", "surface"):
        assert "full of it" not in zoobench("run", "--dry-run", "--env", f"ocean[water={water}]", *words).err


def test_a_failed_run_gives_exit_code_1_and_is_repeated_only_on_demand(
    zoobench: Command, tmp_path: Path, pretend: Callable[..., None]
) -> None:
    """Another `run` leaves it alone but is not content; --retry does it again."""
    pretend("fail")
    reply = zoobench("run", *CELL, "--seeds", "1")
    assert reply.code == 1
    assert "zoobench show 1 --log" in reply.err
    pretend()
    reply = zoobench("run", *CELL, "--seeds", "1")
    assert reply.code == 1
    assert "1 failed before" in reply.err
    assert zoobench("run", *CELL, "--seeds", "1", "--retry", "diverged").code == 1
    assert states(tmp_path / "zoobench.db") == [RunState.FAILED]
    assert zoobench("run", *CELL, "--seeds", "1", "--retry", "failed").code == 0
    assert states(tmp_path / "zoobench.db") == [RunState.DONE]


def test_rerun_does_a_finished_run_again(zoobench: Command, tmp_path: Path, pretend: Callable[..., None]) -> None:
    """The earlier attempt stays on record, and the numbers are the same.

    The hint names another database; after a smoke run it leads to the results, since tables do not show them.
    """
    pretend()
    elsewhere = ("--seeds", "1", "--smoke", "--db", "my runs.db")
    reply = zoobench("run", *CELL, *elsewhere)
    assert reply.err.splitlines()[-1] == "Next: zoobench results --db 'my runs.db'"
    with Store(tmp_path / "my runs.db") as store:
        before = store.finals(1)
    reply = zoobench("run", *CELL, *elsewhere, "--rerun", "rand*")
    assert reply.code == 0
    assert "1 to be repeated" in reply.err
    with Store(tmp_path / "my runs.db") as store:
        assert [attempt.outcome for attempt in store.attempts(1)] == [RunState.DONE, RunState.DONE]
        assert store.finals(1) == before
    assert "none of the finished runs" in zoobench("run", *CELL, *elsewhere, "--rerun", "nothing").err


@pytest.mark.slow
def test_the_time_limit_ends_a_run_as_a_timeout(
    zoobench: Command, tmp_path: Path, pretend: Callable[..., None]
) -> None:
    """A run that hangs is TIMEOUT, which is not FAILED."""
    pretend("hang", iterations=2)
    reply = zoobench("run", *CELL, "--seeds", "1", "--timeout", "2s")
    assert reply.code == 1
    assert states(tmp_path / "zoobench.db") == [RunState.TIMEOUT]


@pytest.mark.slow
def test_an_interrupted_run_says_how_to_go_on(
    zoobench: Command, tmp_path: Path, pretend: Callable[..., None], ctrl_c: None
) -> None:
    """Ctrl-C: exit code 130, and the same command goes on with a second attempt from the checkpoint."""
    pretend(iterations=2000, pause=0.05)

    def interrupt_when_running() -> None:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if (tmp_path / "zoobench.db").exists():
                with Store(tmp_path / "zoobench.db") as store:
                    if any(attempt.progressed for attempt in store.attempts(1)):
                        break
            time.sleep(0.2)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt_when_running)
    thread.start()
    reply = zoobench("run", *CELL, "--seeds", "1")
    thread.join()
    assert reply.code == 130
    assert "type the same command again" in reply.err
    assert "Traceback" not in reply.err
    assert states(tmp_path / "zoobench.db") == [RunState.QUEUED]

    pretend(iterations=20)
    reply = zoobench("run", *CELL, "--seeds", "1")
    assert reply.code == 0
    assert "0 new, 1 in progress" in reply.err
    with Store(tmp_path / "zoobench.db") as store:
        first, second = store.attempts(1)
    assert (first.outcome, second.outcome) == (RunState.CANCELLED, RunState.DONE)
    assert second.resumed


def test_plan_runs_nothing_and_makes_no_database(zoobench: Command, tmp_path: Path) -> None:
    """Two new runs of about a minute by the measured rates, unknown on hills where none was; the sum as talk."""
    reply = zoobench("run", "--dry-run", *CELL, "--format", "json")
    records = json.loads(reply.out)
    assert [(record["seed"], record["state"]) for record in records] == [(0, "new"), (1, "new")]
    assert all(1.0 < record["estimate_s"] < 600.0 for record in records)
    assert re.search(r"new +(\d+ min )?\d+ s\n", zoobench("run", "--dry-run", *CELL).out)
    assert "2 runs to do of 2" in reply.err
    assert "Estimated: 2 by measured rates" in reply.err
    assert re.search(r"Memory: up to [1-9][0-9]+ MiB per run", reply.err)
    reply = zoobench("run", "--dry-run", "--env", "desert[relief=0.01]", *CELL[2:], "--format", "json")
    assert {record["estimate_s"] for record in json.loads(reply.out)} == {None}
    assert "Estimated: 2 unknown" in reply.err
    assert "Memory" not in reply.err
    assert list(tmp_path.iterdir()) == []


def test_plan_knows_what_is_done_and_judges_by_the_past(zoobench: Command, tmp_path: Path) -> None:
    """A finished seed is done, and gives the other one an estimate."""
    cells = expand(RunRequest(RunSelection("desert", "turning", method="random")).grid())
    with Store(tmp_path / "zoobench.db") as store:
        assert isinstance(cells[0], RunSpec)
        add_done(store, cells[0], 1.0)
    first, second = json.loads(zoobench("run", "--dry-run", *CELL, "--format", "json").out)
    assert (first["state"], second["state"]) == ("done", "new")
    assert (first["estimate_s"], round(second["estimate_s"])) == (None, 0)


def test_the_repeat_command_makes_the_same_run() -> None:
    """What `show RUN` prints, typed into `run`, has the same key: every setting survives the way through text."""
    import shlex

    chosen = RunSelection("desert[friction=0.3]", "turning")
    grid = RunRequest(chosen, seeds="7,", budget="1.5 seconds", frames=9).grid()
    for cell in expand(grid):
        assert isinstance(cell, RunSpec)
        words = shlex.split(repeat_command(cell))[2:]
        options = dict(zip((name.removeprefix("--") for name in words[::2]), words[1::2], strict=True))
        settings = {name: options.pop(name) for name in ("seeds", "budget")}
        frames = int(options.pop("frames"))
        (again,) = expand(RunRequest(RunSelection(**options), **settings, frames=frames).grid())  # type: ignore[arg-type]
        assert isinstance(again, RunSpec)
        assert again.key() == cell.key()


@pytest.mark.parametrize(("text", "seeds"), [("3", (0, 1, 2)), ("0,4,7", (0, 4, 7)), ("4,", (4,)), (" 2 , 2 ", (2,))])
def test_seeds_are_a_count_or_a_list(text: str, seeds: tuple[int, ...]) -> None:
    """A bare number counts, a list names, each seed once."""
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize(("text", "seconds"), [("90", 90.0), ("90s", 90.0), ("10 min", 600.0), ("1.5h", 5400.0)])
def test_durations(text: str, seconds: float) -> None:
    """Seconds, minutes and hours."""
    assert parse_duration(text) == seconds


@pytest.mark.parametrize("text", ["", "0s", "-3s", "2d", "1h30"])
def test_malformed_durations(text: str) -> None:
    """Anything else is refused."""
    with pytest.raises(UsageError, match="time limit"):
        parse_duration(text)


@pytest.mark.parametrize("words", [("run", *CELL, "--timeout"), ("work", "--timeout"), ("work", "--max-time")])
def test_an_empty_time_limit_is_refused(zoobench: Command, words: tuple[str, ...]) -> None:
    """It is no way to say that there is none, and nothing is begun."""
    reply = zoobench(*words, "")
    assert (reply.code, "Cannot read '' as a time limit" in reply.err) == (2, True)


def test_python_m_zoobench_is_the_command_line() -> None:
    """The module form works where the script is not on the path."""
    done = subprocess.run([sys.executable, "-m", "zoobench", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("zoobench ")


def test_on_ray_the_pool_knows_what_a_run_takes(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The address as it was given, and the measured memory, for Ray to place runs by."""
    monkeypatch.setattr(engines, "find_spec", lambda library: library)
    pool = create_autospec(ray_pool.RayPool, side_effect=UsageError("No Ray cluster answers."))
    monkeypatch.setattr(ray_pool, "RayPool", pool)
    reply = zoobench("run", *CELL, "--seeds", "1", "--on", "ray=head:6379")
    assert (reply.code, "No Ray cluster answers." in reply.err) == (2, True)
    told = pool.call_args.kwargs
    assert told["address"] == "head:6379"
    assert 10**8 < told["memory"] < 10**10


def test_a_robot_in_its_rest_frame_is_refused_in_a_bed(zoobench: Command) -> None:
    """With the reason, before anything is simulated; beside firm ground it is left out."""
    words = ("--task", "turning", "--method", "random", "--seeds", "1", "--fidelity", "smoke[robot=lagrangian]")
    reply = zoobench("run", "--env", "desert,ocean[water=grid]", *words)
    assert reply.code == 2
    assert "moves on firm ground and in water by forces on its surface alone, and 'desert' has a bed" in reply.err
    assert "'ocean' has a bed, other water, an object or an obstacle" in reply.err
    beside = zoobench("run", "--dry-run", "--env", "ground,desert", *words)
    assert beside.code == 0
    assert "1 runs to do of 1, 1 skipped" in beside.err
