"""A process that does run after run gives each the numbers that it has as the first, bit for bit."""

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pytest

from tests.conformance.cells import POND, cell
from tests.harness.helpers import Numbers, numbers
from zoobench.db.rows import Claim, RunState
from zoobench.db.store import Store
from zoobench.harness.executor import Executor
from zoobench.harness.messages import LastWord, ReferenceWantedMessage
from zoobench.harness.process import CHILD_COMMAND, Idle, StartedProcess
from zoobench.harness.worker import settings_of_children
from zoobench.harness.worker_pool import run_all
from zoobench.spec import Budget, RunSpec

_TWO = Budget("iterations", 2)
_POLICY = "policy-network[hidden=8]"
_SHORT_PPO = "ppo[timesteps=0,buffer=16,batch=8,epochs=1,worlds=2]"
_ON_GROUND = [
    cell(_TWO, method="diffphysics[restarts=1]", fidelity="smoke[precision=64]"),
    cell(_TWO, method="cmaes[population=4]", controller="sine-feedback"),
    cell(_TWO, method="diffphysics[restarts=1]", task="turning"),
]
"""Both precisions, with gradients and without, open and closed loops."""

_ELSEWHERE = [
    cell(_TWO, method="random[batch=2]"),
    cell(_TWO, method=_SHORT_PPO, controller=_POLICY),
    cell(_TWO, method="diffphysics[restarts=1]", environment="desert"),
    cell(_TWO, method="diffphysics[restarts=1]", environment="clay"),
    cell(_TWO, method="random[batch=2]", environment="wetland", design="panda"),
    cell(_TWO, method="cmaes[population=4]", environment="snow"),
    cell(_TWO, method="diffphysics[restarts=1]", environment=POND, design="fish"),
    cell(_TWO, method="diffphysics[restarts=1]", fidelity="smoke[robot=lagrangian]"),
    cell(_TWO, method="diffphysics[restarts=1]", design="voxel"),
    cell(_TWO, method="evolution[population=4,generations=0]", design="voxel"),
    cell(_TWO, method="neat[population=4]", design="voxel"),
    cell(_TWO, method="quality-diversity[population=4]", design="voxel"),
]
"""Learning and other methods, every kind of matter, another grid, and bodies that change."""


def _in_turn(path: Path, specs: Sequence[RunSpec], renewals: int = 0) -> dict[str, tuple[Numbers, object]]:
    """All numbers of each run by its key; they are done one after the other, by one process and so many more."""
    with Store(path) as store:
        ids = store.enqueue(specs).new
    rows = run_all(path, ids, jobs=1)
    assert [(row.state, row.reason) for row in rows] == [(RunState.DONE, None)] * len(specs)
    with Store(path) as store:
        ended = [str(row.spec) for row in rows if store.attempts(row.id)[0].exit_code is not None]
        assert len(ended) <= renewals, ended
        return {row.spec.key(): (numbers(path, row.id), store.solution(row.id)) for row in rows}


@pytest.mark.slow
def test_no_run_is_another_for_what_was_done_before_it(tmp_path: Path) -> None:
    """In one order and in the other: precision, gradients, random streams."""
    assert _in_turn(tmp_path / "there.db", _ON_GROUND) == _in_turn(tmp_path / "back.db", _ON_GROUND[::-1])


@pytest.mark.slow
def test_nor_for_what_was_done_elsewhere(tmp_path: Path) -> None:
    """With every kind of matter, both grids and bodies of every kind, and each as the first of its process, too."""
    specs = [*_ON_GROUND, *_ELSEWHERE]
    there, back = _in_turn(tmp_path / "there.db", specs, 3), _in_turn(tmp_path / "back.db", specs[::-1], 3)
    assert there == back
    for number, spec in enumerate(specs):
        assert _in_turn(tmp_path / f"{number}.db", [spec]) == {spec.key(): there[spec.key()]}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere peaks are of the whole process")
def test_memory_does_not_grow_from_run_to_run() -> None:
    """Of twenty runs of two cells neither the peaks nor what is left, once both had their turn."""
    left, peaks = [], []
    with settings_of_children(), Executor(partial(StartedProcess, CHILD_COMMAND)) as executor:
        for number in range(20):
            pair = (_ON_GROUND[0], cell(_TWO, seed=number, method="random[batch=2]", environment="desert"))
            claim = Claim(1, pair[number % 2], "owner", 1, None)
            child = executor.child_for(claim, {})
            child.begin(claim)
            while not isinstance(event := child.next(60.0), Idle):
                if isinstance(event, ReferenceWantedMessage):
                    child.answer(0.0, "m/s")
                if isinstance(event, LastWord):
                    peaks.append(event.peak_memory)
            left.append(child.memory())
    assert max(left[4:]) < 1.02 * max(left[2:4])
    for peak in (peaks[::2], peaks[1::2]):
        assert max(peak[2:]) < 1.02 * max(peak[:2])
