"""The child process with the real simulator in it: what it reports, and that a killed run comes to the same end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conformance.cells import cell
from tests.harness.helpers import Killer, numbers
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.db.rows import RunRow, RunState
from zoobench.db.store import Store
from zoobench.harness import child, presets, supervise, worker_pool
from zoobench.harness.child import needs_own_process
from zoobench.harness.grid import expand
from zoobench.harness.worker_pool import run_all
from zoobench.inputs import Start
from zoobench.methods.archive import Archive
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

_KILLS = 2

# Iterations that are short, so that a kill falls into one of many.
_SETTINGS = {
    "cmaes": "cmaes[population=4]",
    "diffphysics": "diffphysics[restarts=1]",
    "evolution": "evolution[population=4,generations=0]",
    "neat": "neat[population=4]",
    "ppo": "ppo[timesteps=0,buffer=16,batch=8,epochs=1,worlds=2]",
    "quality-diversity": "quality-diversity[population=4]",
    "random": "random[batch=1]",
}
_FAST = ("cmaes",)


def _iterations(method: str) -> int:
    """So many that a run lasts for some of the launcher's looks at it, and for long after its kill was decided upon."""
    return 110 if method in _FAST else 150


@pytest.fixture(autouse=True)
def _frequent_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A launcher that looks and stores so often that it meets every run in its midst, however fast the simulator is."""
    monkeypatch.setattr(worker_pool, "POLL_SECONDS", 0.1)
    monkeypatch.setattr(supervise, "CHECKPOINT_SECONDS", 0.1)


_TAGS = {name: registry.get(Kind.METHOD, name).tags for name in registry.names(Kind.METHOD)}
_EXACT = [
    pytest.param(name, marks=pytest.mark.slow)  # tests/harness/test_kill.py kills runs of a small method
    for name, tags in _TAGS.items()
    if not tags & {"policy", "study", "external"}
]
_POLICY = [pytest.param(name, marks=pytest.mark.slow) for name, tags in _TAGS.items() if "policy" in tags]


def _queue(path: Path, method: str) -> tuple[int, ...]:
    """One run in the cheapest cell that suits the method."""
    smoke, tags = presets.get("smoke"), _TAGS[method]
    designs = [Ref("voxel")] if tags & {"space", "sites"} else None
    controllers = [Ref.parse("policy-network[hidden=8]")] if "policy" in tags else None
    grid = smoke.grid(
        [Ref("ground")],
        [Ref("movement-speed")],
        designs=designs,
        controllers=controllers,
        methods=[Ref.parse(_SETTINGS.get(method, method))],
        budget=Budget("iterations", _iterations(method)),
    )
    with Store(path) as store:
        return store.enqueue(run for run in expand(grid) if isinstance(run, RunSpec)).open


def _batter(tmp_path: Path, method: str) -> tuple[Path, RunRow]:
    """A run that was killed, once if fast, and its database."""
    path, kills = tmp_path / "battered.db", 1 if method in _FAST else _KILLS
    killer = Killer(method, kills)
    (row,) = run_all(path, _queue(path, method), on_update=killer)
    assert killer.done == kills, "the run ended before it could be killed"
    assert (row.state, row.attempt) == (RunState.DONE, kills + 1)
    return path, row


@pytest.mark.parametrize("method", _EXACT)
def test_a_killed_run_ends_as_an_undisturbed_one(tmp_path: Path, method: str) -> None:
    """The two runs of one spec agree bit for bit in every stored number, though one was killed again and again."""
    calm = tmp_path / "calm.db"
    (other,) = run_all(calm, _queue(calm, method))  # first, since a killed child leaves no compiled kernel to others
    assert other.attempt == 1
    battered, row = _batter(tmp_path, method)
    assert numbers(battered, row.id) == numbers(calm, other.id)
    with Store(calm) as store:
        finals = {final.name: final.value for final in store.finals(other.id)}
        assert finals["iterations"] == _iterations(method)
        assert finals["forward_substeps"] > 0.0
        assert {"idle_score", "random_score"} <= set(finals)
        assert finals["score"] == max(point.value for point in store.metrics(other.id, "score_current"))
        assert other.score == finals["score"]
        params, archive = store.solution(other.id), store.archive(other.id)
        kept_on_the_way = store.milestones(other.id)
    assert params is not None
    steps = [row.step for row in kept_on_the_way]
    assert steps[0] == 1
    assert all(step & (step - 1) == 0 for step in steps)
    assert Problem(other.spec).evaluate(np.array(kept_on_the_way[0].params)).score == kept_on_the_way[0].score
    assert kept_on_the_way[-1].score <= finals["score"]
    assert Problem(other.spec).evaluate(np.array(params)).score == finals["score"]
    with Store(battered) as store:
        assert store.solution(row.id) == params
        kept = store.archive(row.id)
    assert (kept is None) is (archive is None) is ("space" not in _TAGS[method])
    if kept and archive:
        elites, others = Archive.from_bytes(kept).arrays(), Archive.from_bytes(archive).arrays()
        assert elites["scores"][0] == finals["score"]
        for name, array in elites.items():
            np.testing.assert_array_equal(array, others[name])


def test_other_code_and_gpus_have_a_process_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plug-in may do to it what it likes, also one in a stored run that is begun with, and so may an agent."""
    own, agent = (replace(cell(), method=registry.get(Kind.METHOD, name).ref_with({})) for name in ("ppo", "external"))
    plugin = cell(seed=7)
    monkeypatch.setattr(child, "plugins_of", lambda spec: {"method": {}} if spec == plugin else {})
    assert not needs_own_process(own, [Start(cell(), (1.0,))])
    assert needs_own_process(agent, [])
    assert needs_own_process(plugin, [])
    assert needs_own_process(own, [Start(plugin, (1.0,))])
    assert needs_own_process(cell(fidelity="draft[device=cuda]"), [])


@pytest.mark.parametrize("method", _POLICY)
def test_a_killed_run_of_a_policy_says_that_it_was_resumed(tmp_path: Path, method: str) -> None:
    """It begins its episodes anew, so that it is another run: to the same count, and labelled."""
    battered, row = _batter(tmp_path, method)
    with Store(battered) as store:
        finals = {final.name: final.value for final in store.finals(row.id)}
        params = store.solution(row.id)
    assert finals["resumed"] == _KILLS
    assert finals["iterations"] == _iterations(method)
    assert finals["timesteps"] == 16 * _iterations(method)
    assert params is not None
    assert Problem(row.spec).evaluate(np.array(params)).score == finals["score"]
