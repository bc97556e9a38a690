"""A real cluster of Ray on this machine, of which a node is taken away."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import ROOT
from tests.harness.helpers import enqueue, fake, numbers, work_on_fakes
from zoobench.db.rows import RunRow, RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.harness.ray_pool import RayPool, resources
from zoobench.harness.worker_pool import run_all


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A head that computes nothing, and two nodes with a processor each."""
    ray = pytest.importorskip("ray")
    cluster_utils = pytest.importorskip("ray.cluster_utils")

    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    made = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    made.first, made.second = made.add_node(num_cpus=1), made.add_node(num_cpus=1)
    made.wait_for_nodes()
    yield made
    ray.shutdown()
    made.shutdown()


def test_a_place_asks_for_what_a_run_takes() -> None:
    """The limit, or what is expected as far as a node has it; a limit that no node has is refused."""
    nodes = ({"CPU": 0.0}, {"CPU": 4.0, "memory": 8e9}, {"CPU": 1.0, "memory": 2e9})
    assert resources(None, None, nodes) == {"num_cpus": 1}
    assert resources(None, 3_000_000_000, nodes) == {"num_cpus": 1, "memory": 3_000_000_000}
    assert resources(None, 9_000_000_000, nodes) == {"num_cpus": 1, "memory": 8_000_000_000}
    assert resources(1_000_000_000, 3_000_000_000, nodes) == {"num_cpus": 1, "memory": 1_000_000_000}
    with pytest.raises(UsageError, match="largest node of the Ray cluster offers 7"):
        resources(9_000_000_000, None, nodes)


@pytest.mark.slow
def test_a_grid_survives_the_loss_of_a_node(cluster: Any, tmp_path: Path) -> None:
    """Each run is done once; that of the lost node goes on from its checkpoint, to the numbers of one undisturbed."""
    path, straight = tmp_path / "zoo.db", tmp_path / "straight.db"
    ids = enqueue(path, 4)
    begun: set[int] = set()

    def take_away(rows: list[RunRow]) -> None:
        begun.update(row.id for row in rows if row.state is RunState.RUNNING and row.fraction > 0.1)
        if len(begun) == 2 and cluster.second is not None:
            cluster.remove_node(cluster.second, allow_graceful=False)
            cluster.second = None

    engine = partial(RayPool, address=cluster.address)
    rows = run_all(path, ids, jobs=2, child=fake(iterations=400), engine=engine, on_update=take_away)
    assert cluster.second is None
    assert [row.state for row in rows] == [RunState.DONE] * 4
    with Store(path) as store:
        outcomes = [[attempt.outcome for attempt in store.attempts(run_id)] for run_id in ids]
        resumed = [attempt.resumed for run_id in ids for attempt in store.attempts(run_id)[1:]]
    assert sorted(map(len, outcomes)) == [1, 1, 1, 2]
    assert [RunState.LOST, RunState.DONE] in outcomes
    assert resumed == [True]
    work_on_fakes(straight, 4, child=fake(iterations=400, pause=0.0))
    assert [numbers(path, run_id) for run_id in ids] == [numbers(straight, run_id) for run_id in ids]
