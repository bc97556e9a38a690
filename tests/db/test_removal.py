"""Removing runs leaves nothing of them behind."""

from pathlib import Path

import pytest
from sqlalchemy import func, select

from tests.report.content import PROVENANCE, add_done, claim_new, make_spec
from zoobench.db.models import Base
from zoobench.db.removal import dependents
from zoobench.db.rows import Batch, Ending, MilestoneRow, RunState, StudyRow
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.inputs import run_name


def test_nothing_of_a_removed_run_is_left(location: str) -> None:
    """Every table is as empty as before it, but for what belongs to the run that stays."""
    with Store(location) as store:
        before = _sizes(store)
        claim = claim_new(store, make_spec())
        store.begin_sweep([claim.run_id])
        store.reference(claim, "a reference")
        batch = Batch(metrics={("score", 1): 1.0}, milestones={1: MilestoneRow(1, 1.0, (0.5,))}, checkpoint=b"x")
        batch.log("a line")
        store.finish(claim, Ending(RunState.DONE, params=(0.5,), archive=b"y"), batch)
        list(store.save_study("transfer", [StudyRow("run 1 in ice", "OK", {"run": 1})], provenance=PROVENANCE))
        store.remove([1])
        after = _sizes(store)
        for table in ("sweeps", "studies", "provenance"):  # a sweep without runs; the study and where it was made
            assert after.pop(table) <= 1
            before.pop(table)
        assert after == before


def test_a_run_that_stays_keeps_everything(tmp_path: Path) -> None:
    """Its digest still holds."""
    with Store(tmp_path / "zoo.db") as store:
        for seed in range(2):
            add_done(store, make_spec(seed=seed), 1.0)
        store.remove([1])
        assert [run.id for run in store.runs()] == [2]
        assert store.damage() == []
        assert store.finals(2) != []


def test_a_run_in_progress_is_not_removed(tmp_path: Path) -> None:
    """Its worker would lose it; nothing is removed then."""
    with Store(tmp_path / "zoo.db") as store:
        add_done(store, make_spec(), 1.0)
        claim_new(store, make_spec(seed=1))
        with pytest.raises(UsageError, match="zoobench cancel 2"):
            store.remove([1, 2])
        assert len(store.runs()) == 2


def test_what_a_run_needs_is_found_along_the_chain(tmp_path: Path) -> None:
    """The run that starts from it, and the one that keeps the gait of that one; no other."""
    with Store(tmp_path / "zoo.db") as store:
        first = make_spec()
        second = make_spec(method=f"diffphysics-v2[start={run_name(first.key())}]")
        third = make_spec(controller=f"stored-v1[run={run_name(second.key())}]")
        for spec in (first, second, third, make_spec(seed=1)):
            add_done(store, spec, 1.0)
        assert [run.id for run in dependents(store.runs(), [1])] == [2, 3]
        assert dependents(store.runs(), [3]) == []


def _sizes(store: Store) -> dict[str, int]:
    with store._database.read() as session:
        tables = Base.metadata.tables.items()
        return {name: session.scalar(select(func.count()).select_from(table)) or 0 for name, table in tables}
