"""A leaderboard and its export: all of it, in one form, and nothing that was tampered with."""

import json
import math
from pathlib import Path

import pytest
from sqlalchemy import text

from tests.report.boards import asked, board
from tests.report.content import add_done, claim_new, make_spec
from zoobench.db.rows import Batch, Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError, UsageError
from zoobench.report.leaderboard import gather
from zoobench.report.leaderboard_export import from_text, to_text
from zoobench.spec import RunSpec


def test_every_run_of_the_suite_is_there_in_its_order(tmp_path: Path) -> None:
    """Done, unsuccessful, open, missing and skipped ones; the smoke run is left out."""
    found = board(tmp_path)
    assert [entry.spec for entry in found.rows] == [spec for spec, _ in asked()[:-1]]
    states = [str(entry.state) for entry in found.rows[:9]]
    assert states == ["done"] * 6 + ["None"] * 3
    ice = [str(entry.state) for entry in found.rows[9:15]]
    assert ice == ["done", "done", "diverged", "failed", "running", "queued"]
    assert (found.rows[-1].state, found.rows[-1].reason) == (RunState.SKIPPED, "needs a space")
    assert len(found.missing()) == 3 + 3 + 9
    assert len(found.results()) == 28 - 15


def test_the_export_says_everything(tmp_path: Path) -> None:
    """What is read from it is what was written, and it is written again in the same bytes."""
    found = board(tmp_path)
    text = to_text(found)
    again = from_text(text, "mine.json")
    assert to_text(again) == text
    assert [entry.spec for entry in again.rows] == [entry.spec for entry in found.rows]
    assert [entry.finals for entry in again.rows] == [entry.finals for entry in found.rows]
    assert [entry.reason for entry in again.rows] == [entry.reason for entry in found.rows]
    assert (again.name, again.source, again.summary) == (found.name, found.source, found.summary)


def test_an_earlier_export_completes_a_later_one(tmp_path: Path) -> None:
    """What came to an end here counts; for the rest what came to an end there, and nothing that is not asked for."""
    (tmp_path / "one").mkdir()
    earlier = board(tmp_path / "one")
    spec, *_ = (spec for spec, _ in asked())
    later_spec = make_spec(env="snow-v1", method="diffphysics-v2[lr=0.1]")
    with Store(tmp_path / "runs.db") as store:
        add_done(store, spec, 9.0)
        add_done(store, later_spec, 8.0)
        store.enqueue([make_spec(seed=1)])
        later = gather(store, "mine", "mine.yaml", "a test of pages", asked()[:-1][:20])
    found = later.completed(earlier)
    scores = [entry.finals["score"].value if "score" in entry.finals else None for entry in found.rows]
    assert scores[:3] == [9.0, 1.001, 1.002]
    assert scores[18] == 8.0
    states = [str(entry.state) for entry in found.rows[9:15]]
    assert states == ["done", "done", "diverged", "failed", "None", "None"], "what was in progress there is unknown"
    assert len(found.rows) == 20
    assert to_text(from_text(to_text(found), "mine.json")) == to_text(found)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"cpu":{"cores":4,"model":"Example 9000","threads":8}', '"cpu":"Example 9000"'),
        ('"packages":{"taichi":"1.7.4","torch":null,"zoobench":"0.1.0"}', '"packages":5'),
        ('"gpus":[]', '"gpus":0'),
        ('"started_at":', '"started_at":{},"at":'),
        ('"lr":0.1', '"lr":{}'),
    ],
)
def test_an_export_edited_by_hand_is_refused(tmp_path: Path, old: str, new: str) -> None:
    """What is of another kind than was written is told before anything is made of it."""
    text = to_text(board(tmp_path))
    assert old in text
    with pytest.raises(UsageError, match=r"mine\.json is no export"):
        from_text(text.replace(old, new, 1), "mine.json")


def test_equal_content_is_equal_text(tmp_path: Path) -> None:
    """Two looks at one database, though a run is in progress; a line for each run, one for those that a cell lacks."""
    text = to_text(board(tmp_path))
    assert to_text(board(tmp_path)) == text
    document = json.loads(text)
    listed = ("runs", "provenance", "components")
    assert len(text.splitlines()) == 8 + sum(len(document[name]) for name in listed)
    assert [run["seeds"] for run in document["runs"] if run["state"] == "missing"] == [[0, 1, 2]] * 5
    assert len(document["provenance"]) == 1


def test_the_export_tells_the_origin_but_not_the_machines_name(tmp_path: Path) -> None:
    """Commit, packages and processor, of a provenance that names the host as well."""
    with Store(tmp_path / "runs.db") as store:
        from zoobench.db.owner import Owner
        from zoobench.harness import provenance

        spec = make_spec()
        claim = store.claim(Owner.current(), provenance=provenance.gather(), ids=store.enqueue([spec]).new)
        assert claim is not None
        store.finish(claim, Ending(RunState.DONE, finals=(FinalRow("score", 1.0, "m/s"),)), Batch())
        text = to_text(gather(store, "mine", "mine", "a test", [(spec, None)]))
    (document,) = json.loads(text)["provenance"]
    assert set(document) == {"code", "cpu", "gpus", "memory", "packages", "python"}
    assert provenance.gather()["host"] not in (text if len(provenance.gather()["host"]) > 3 else "")


def test_a_value_that_is_not_finite_survives(tmp_path: Path) -> None:
    """JSON has no NaN: it is null there, and NaN again when it is read."""
    spec = make_spec()
    with Store(tmp_path / "runs.db") as store:
        add_done(store, spec, math.nan)
        text = to_text(gather(store, "mine", "mine", "a test", [(spec, None)]))
    assert "NaN" not in text
    assert math.isnan(from_text(text, "mine.json").rows[0].finals["score"].value)


def test_what_led_to_a_former_result_is_no_origin(tmp_path: Path) -> None:
    """A run done again comes from its newest attempt alone, and is not done while that lasts."""
    spec = make_spec()
    with Store(tmp_path / "runs.db") as store:
        number = add_done(store, spec, 1.0)
        store.retry([number], states=[RunState.DONE])
        (entry,) = gather(store, "mine", "mine", "a test", [(spec, None)]).rows
        assert (entry.state, entry.finals, entry.attempts, entry.seconds) == (RunState.QUEUED, {}, (), 0.0)


def test_a_suite_of_smoke_runs_has_no_leaderboard(tmp_path: Path) -> None:
    """Their numbers mean nothing."""
    with Store(tmp_path / "runs.db") as store, pytest.raises(UsageError, match="no table shows those"):
        gather(store, "mine", "mine", "a test", [(make_spec(fidelity="smoke-v1"), None)])


def _of(path: Path) -> dict[str, object]:
    with Store(path / "runs.db") as store:
        claim = claim_new(store, make_spec(seed=1))
        store.finish(claim, Ending(RunState.FAILED, "boom"), Batch())
        add_done(store, make_spec(), 1.0)
        specs: list[tuple[RunSpec, str | None]] = [(make_spec(), None), (make_spec(seed=1), None)]
        return json.loads(to_text(gather(store, "mine", "mine", "a test", specs)))  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"format": 1', '"format": 2', "its format is 2, and this zoobench reads 1"),
        ('"seed": 0', '"seed": 7', "the key .* is not that of desert x turning x caterpillar x diffphysics seed 7"),
        ('"state": "done"', '"state": "won"', "won"),
        ('"state": "done"', '"state": "failed"', "is failed and has results"),
        ('"state": "failed"', '"state": "done"', "seed 1 is done, and no attempt says where"),
        ('"runs":', '"walks":', "no 'runs'"),
        ('"provenance": 0', '"provenance": 5', "out of range"),
        ('"value": 1.0', '"value": NaN', "NaN is no JSON"),
        ('"value": 1.0', '"value": "much"', "much"),
        ("{", "", "Expecting|Extra"),
    ],
)
def test_an_export_that_is_none_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    """Another format, settings that are not those of the key, results without origin, broken JSON."""
    text = json.dumps(_of(tmp_path))
    assert old in text
    with pytest.raises(UsageError, match=f"mine.json is no export of a leaderboard: .*({message})"):
        from_text(text.replace(old, new, 1), "mine.json")


def test_an_export_with_a_run_twice_or_of_smoke_is_refused(tmp_path: Path) -> None:
    """Neither comes from a suite."""
    document = _of(tmp_path)
    runs = document["runs"]
    assert isinstance(runs, list)
    with pytest.raises(UsageError, match="comes twice"):
        from_text(json.dumps({**document, "runs": [runs[0], runs[0]]}), "mine.json")
    components = json.loads(json.dumps(document["components"]))
    components[runs[0]["spec"]["fidelity"]] = {"name": "smoke", "version": 1, "params": {}}
    run = {**runs[0], "key": make_spec(fidelity="smoke-v1").key()}
    with pytest.raises(UsageError, match="is a smoke run"):
        from_text(json.dumps({**document, "components": components, "runs": [run]}), "mine.json")


def test_a_changed_result_is_not_published(tmp_path: Path) -> None:
    """Another run of the database may be as damaged as it likes."""
    spec, other = make_spec(), make_spec(seed=1)
    with Store(tmp_path / "runs.db") as store:
        numbers = add_done(store, spec, 1.0), add_done(store, other, 1.0)
        with store._database.write() as session:
            session.execute(text(f"UPDATE finals SET value = 2.0 WHERE run_id = {numbers[0]} AND name = 'score'"))
        with pytest.raises(StorageError, match="the results of run 1 have changed"):
            gather(store, "mine", "mine", "a test", [(spec, None)])
        assert gather(store, "mine", "mine", "a test", [(other, None)]).rows[0].finals["score"].value == 1.0


def test_a_deep_export_is_refused() -> None:
    """In words."""
    with pytest.raises(UsageError, match=r"mine\.json is no export"):
        from_text("[" * 100_000, "mine.json")
