"""Questions about many runs give what the documents and rows behind them give."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import select, update

from tests import large
from tests.report.content import PROVENANCE, add_done, claim_new, fill, make_spec
from zoobench.db import runs
from zoobench.db.models import SpecRecord
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, RunRow, RunState
from zoobench.db.specs import spec_from
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.report.cells import cells_of, read_cells
from zoobench.report.run_results import choose_results
from zoobench.spec import Ref, RunSelection, canonical_json

LONG = Ref("mesh", 1, (("path", "deep/" * 60 + "body.stl"), ("up", "auto")))


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A large database, as large as a test can wait for."""
    path = tmp_path_factory.mktemp("large") / "runs.db"
    large.make(str(path), 600, 2)
    return str(path)


@pytest.fixture
def store(place: str) -> Iterator[Store]:
    """The same, open."""
    with Store(place, create=False) as store:
        yield store


@pytest.mark.parametrize(
    "selection",
    [
        RunSelection(),
        RunSelection(method="random,diffphysics[lr=0.05]"),
        RunSelection(design="f*", controller="sine-feedback", fidelity="draft"),
    ],
)
def test_cells_are_those_of_the_runs_themselves(store: Store, selection: RunSelection) -> None:
    """Read without an object for each run, they are the same in every number, and in the same order."""
    assert read_cells(store, selection) == cells_of(choose_results(store, selection))


def test_settings_are_those_of_the_documents(location: str) -> None:
    """Whatever is too long for a column, or cannot be read from it, comes from the document."""
    specs = [
        make_spec(),
        make_spec(env="desert-v2[friction=0.5,on=True]"),
        *(replace(make_spec(seed=seed), design=LONG) for seed in range(2)),
        replace(make_spec(), design=replace(LONG, params=(("path", "deep/" * 60 + "other.stl"), ("up", "auto")))),
        replace(make_spec(), task=Ref("mix", 1, (("weights", "a=1,b=2"),))),
        replace(make_spec(), task=Ref("mix", 1, (("number", "12"),))),
    ]
    with Store(location) as store:
        ids = store.enqueue(specs).new
        assert [run.spec for run in store.runs()] == specs
        assert [run.spec for run in store.runs(keys=[spec.key() for spec in specs])] == specs
        found = list(store.cells(RunSelection(), ["score"]))
        assert [replace(run.spec, seed=run.seed) for run in found] == specs
        assert found[2].spec is found[3].spec
        chosen = store.selected(RunSelection(design="mesh[path=" + "deep/" * 60 + "body.stl]"))
        assert [run.id for run, _ in chosen] == list(ids[2:4])


def test_columns_that_do_not_fit_the_key_are_not_believed(location: str) -> None:
    """A column serves to search; what it says of a run counts only if the key agrees."""
    with Store(location) as store:
        store.enqueue([make_spec()])
        with store._database.write() as session:
            session.execute(update(SpecRecord).values(env="ice-v1"))
            ((key, document),) = session.execute(select(SpecRecord.key, SpecRecord.document))
        assert store.runs()[0].spec == spec_from(key, document) == make_spec()


def test_a_choice_is_made_by_the_database(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """No run is read but those that are chosen; a name that no run has is refused, and a choice of none."""
    made: list[object] = []
    monkeypatch.setattr(runs, "RunRow", lambda **values: made.append(RunRow(**values)) or made[-1])
    found = choose_results(store, RunSelection(design="fish", method="cmaes", controller="sine-basis"))
    assert [result.run for result in found] == made
    assert len(made) == 5
    with pytest.raises(UsageError, match="Did you mean 'cmaes'"):
        choose_results(store, RunSelection(method="cmae"))
    with pytest.raises(UsageError, match="No run in the database is all that --task, --design"):
        choose_results(store, RunSelection(task="turning", design="tuna"))


def test_origins_are_grouped_and_leave_out_what_was_done_again(tmp_path: Path) -> None:
    """One for each provenance, from the first start to the last end; none of a result that was replaced."""
    with Store(tmp_path / "runs.db") as store:
        ids = [add_done(store, make_spec(seed=seed), 1.0) for seed in range(3)]
        store.retry(ids[:1], states=[RunState.DONE])
        newer = {"code": {"commit": "newer"}}
        claim = store.claim(Owner.current(), provenance=newer)
        assert claim is not None
        store.finish(claim, Ending(RunState.DONE), Batch())
        claim_new(store, make_spec(seed=9))
        found = {canonical_json(origin.provenance): origin for origin in store.origins(range(1, 10))}
        assert set(found) == {canonical_json(PROVENANCE), canonical_json(newer)}
        attempts = [attempt for run_id in ids[1:] for attempt in store.attempts(run_id)]
        assert found[canonical_json(PROVENANCE)].started_at == min(attempt.started_at for attempt in attempts)
        assert found[canonical_json(PROVENANCE)].ended_at == max(attempt.ended_at or 0.0 for attempt in attempts)
        assert [origin.provenance for origin in store.origins(ids[:1])] == [newer]


def test_names_of_finals_are_those_of_the_selected(tmp_path: Path) -> None:
    """With their units, sorted; none of runs that are not done."""
    with Store(fill(tmp_path / "runs.db")) as store:
        names = [("backward_substeps", ""), ("distance", "m"), ("forward_substeps", ""), ("score", "m/s")]
        assert store.final_names(RunSelection()) == names
        assert store.final_names(RunSelection(env="ice", method="random")) == []
