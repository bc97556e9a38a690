"""`evaluate`, of runs and without."""

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from tests.report.content import add_ended
from zoobench.cell.problem import Problem
from zoobench.db.rows import TRANSFER, Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.spec import RunSpec
from zoobench.studies import transfer_study
from zoobench.studies.transfer_study import TransferRow


@pytest.fixture
def score(tmp_path: Path) -> float:
    """A database whose run 1 is a fish's on the ground, with this score."""
    problem = Problem(cell(design="fish", fidelity="draft", frames=3))
    parameters = problem.initial(np.random.default_rng(0))
    score = problem.evaluate(parameters).score
    ending = Ending(RunState.DONE, finals=(FinalRow("score", score, "m/s"),), params=tuple(parameters.tolist()))
    with Store(tmp_path / "zoobench.db") as store:
        add_ended(store, problem.spec, ending)
    return score


def test_a_solution_is_tried_elsewhere_and_kept(zoobench: Command, score: float) -> None:
    """At home it gives the stored score to the last bit; the matrix shows every place."""
    reply = zoobench("evaluate", "1", "--env", "ground,ice", "--task", "movement-speed,turning", "--format", "json")
    assert reply.code == 0, reply.err
    rows = json.loads(reply.out)
    assert len(rows) == 4
    assert rows[0]["score"] == score
    assert len({row["score"] for row in rows}) == 4
    matrix = json.loads(zoobench("evaluate", "--format", "json").out)
    names = [[line[name].partition("-v")[0] for name in ("task", "found_in", "env")] for line in matrix]
    assert names == [[task, "ground", env] for task in ("movement-speed", "turning") for env in ("ground", "ice")]
    assert [line["mean"] for line in matrix if line["n"] == 1] == [rows[place]["score"] for place in (0, 2, 1, 3)]


@pytest.mark.slow
def test_variants_of_an_environment_are_told_apart(zoobench: Command, score: float) -> None:
    """And those of a fidelity: as much of a name as differs stands in every row, and numbers are numbers."""
    envs = "ground[youngs_modulus=2e4],ground[youngs_modulus=5e3]"
    rows = csv.DictReader(io.StringIO(zoobench("evaluate", "1", "--env", envs, "--format", "csv").out))
    assert len({row["env"] for row in rows}) == 2
    level = "draft,draft[transfer=apic]"
    shown = zoobench("evaluate", "1", "--fidelity", level)
    assert [line.split()[4] for line in shown.out.splitlines()[2:]] == ["draft[transfer=aflip]", "draft[transfer=apic]"]
    assert "run 1, ground x movement-speed x draft[transfer=apic]: score" in shown.err
    latex = zoobench("evaluate", "--format", "latex").out
    assert r"\caption{Score [m/s]}" in latex
    assert r"table-space-text-post = {{\scriptsize~(n=1)}}" in latex
    header = zoobench("evaluate").out.splitlines()[2]
    assert header.index("youngs_modulus=5000.0]") < header.index("youngs_modulus=20000.0]")


def test_its_own_place_is_the_default(zoobench: Command, score: float) -> None:
    """One episode, which repeats the stored one."""
    reply = zoobench("evaluate", "1", "--format", "json")
    assert [row["score"] for row in json.loads(reply.out)] == [score]


def test_what_is_left_out_of_the_matrix_is_not_nothing(zoobench: Command, score: float) -> None:
    """Before anything was evaluated, and when only smoke was."""
    assert "No solution was evaluated elsewhere yet" in zoobench("evaluate").err
    assert zoobench("evaluate", "1", "--fidelity", "smoke").code == 0
    shown = zoobench("evaluate", "--format", "json")
    assert json.loads(shown.out) == []
    assert "are of the fidelity smoke" in shown.err


def test_what_cannot_be_evaluated_is_refused(zoobench: Command, score: float) -> None:
    """An unknown run, an unknown environment, choices that a matrix does not take."""
    assert "No run matches" in zoobench("evaluate", "7").err
    assert zoobench("evaluate", "1", "--env", "desrt").code == 2
    refused = zoobench("evaluate", "--env", "ice")
    assert refused.code == 2
    assert "Leave --env ice out" in refused.err


def test_a_gpu_that_is_not_there_is_missed_at_once(
    zoobench: Command, score: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not when the scene has come to rest, which is done on the CPU."""
    built: list[RunSpec] = []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(transfer_study, "Problem", lambda spec, **_: built.append(spec))
    refused = zoobench("evaluate", "1", "--fidelity", "smoke,draft[device=cuda]")
    assert refused.code == 2
    assert "No CUDA device is available" in refused.err
    assert not built


@pytest.mark.parametrize(
    ("names", "why"),
    [
        (
            ("--env", "desert,clay", "--fidelity", "smoke[robot=lagrangian]"),
            "moves on firm ground and in water by forces on its surface alone, and 'desert' has a bed",
        ),
        (("--fidelity", "smoke[step=0.004],smoke[grid_spacing=0.3]"), "shorter than a cell of 0.3 m"),
        (("--task", "push"), "needs an object"),
    ],
)
def test_what_is_not_possible_is_refused_at_once(
    zoobench: Command, score: float, monkeypatch: pytest.MonkeyPatch, names: tuple[str, ...], why: str
) -> None:
    """Not when the episodes before it are simulated."""
    built: list[RunSpec] = []
    monkeypatch.setattr(transfer_study, "Problem", lambda spec, **_: built.append(spec))
    refused = zoobench("evaluate", "1", *names)
    assert refused.code == 2
    assert why in refused.err
    assert "Nothing was evaluated: every episode was skipped" in refused.err
    assert not built


def _add_drawn(database: Path, spec: RunSpec) -> None:
    """A run that is done, with a draw of its prior for a solution."""
    parameters = Problem(spec).initial(np.random.default_rng(0))
    ending = Ending(RunState.DONE, finals=(FinalRow("score", 0.0, "m/s"),), params=tuple(parameters.tolist()))
    with Store(database) as store:
        add_ended(store, spec, ending)


def test_a_body_that_does_not_fit_the_fidelity_is_refused(zoobench: Command, tmp_path: Path) -> None:
    """A row for every particle says nothing about a finer grid's particles."""
    spec = cell(design="particle", controller="fixed-sine", frames=3)
    _add_drawn(tmp_path / "zoobench.db", spec)
    reply = zoobench("evaluate", "1", "--fidelity", "draft")
    assert reply.code == 2
    assert "do not fit particle" in reply.err


def test_the_episodes_that_are_possible_are_done(zoobench: Command, tmp_path: Path) -> None:
    """Those of other runs too; what is skipped is said before the first simulation."""
    for design in ("particle", "caterpillar"):
        _add_drawn(tmp_path / "zoobench.db", cell(design=design, controller="fixed-sine", frames=3))
    reply = zoobench("evaluate", "1", "2", "--fidelity", "smoke,draft", "--format", "json")
    assert reply.code == 0
    assert [(row["run"], row["fidelity"][:5]) for row in json.loads(reply.out)] == [
        (1, "smoke"), (2, "smoke"), (2, "draft"),
    ]  # fmt: skip
    assert reply.err.index("skipped run 1, ground x movement-speed x draft") < reply.err.index("[1/3")


def test_an_episode_that_fails_does_not_end_the_others(
    zoobench: Command, score: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are stored, and the exit code tells."""
    tried = transfer_study.tried

    def failing(run: int, spec: RunSpec, parameters: tuple[float, ...], each: RunSpec) -> TransferRow:
        if each.env.name == "ground":
            raise UsageError("The ground gave way.")
        return tried(run, spec, parameters, each)

    monkeypatch.setattr(transfer_study, "tried", failing)
    reply = zoobench("evaluate", "1", "--env", "ground,ice", "--format", "json")
    assert reply.code == 1
    assert "run 1, ground x movement-speed x draft: The ground gave way." in reply.err
    assert [row["env"].partition("-v")[0] for row in json.loads(reply.out)] == ["ice"]
    with Store("zoobench.db") as store:
        assert len(next(iter(store.studies(TRANSFER))).rows) == 1


def test_a_policy_is_not_tried_where_it_would_see_something_else(zoobench: Command, tmp_path: Path) -> None:
    """As many numbers of another meaning are no observation of its own; another target of the same task is."""
    spec = cell(task="velocity-tracking", controller="sine-feedback", frames=3)
    _add_drawn(tmp_path / "zoobench.db", spec)
    reply = zoobench("evaluate", "1", "--task", "movement-speed")
    assert reply.code == 2
    assert "observes body (8), muscles (60), target velocity (2), time left (1)" in reply.err.replace("\n", " ")
    assert zoobench("evaluate", "1", "--task", "velocity-tracking[path=s-curve]").code == 0
