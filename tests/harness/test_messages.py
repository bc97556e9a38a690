"""What a method says that no database could hold ends its run alone, with the reason; the queue goes on."""

import json
import math
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.harness.helpers import work_on_fakes
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.harness import process
from zoobench.harness.messages import FailedMessage, MetricMessage, RefusedMessageError, read_message


def bad(*oddities: str) -> tuple[str, ...]:
    """The command of a child that does something odd in the run with seed 0, in that with seed 1, and so on."""
    return (sys.executable, "-m", "tests.harness.bad_child", *oddities)


def _metric(step: Any, **values: Any) -> dict[str, Any]:
    return {"type": "metric", "step": step, "values": values}


def _done(**changes: Any) -> dict[str, Any]:
    whole = {"type": "done", "finals": [["score", 1.0, "m"]], "params": [1.0], "archive": None, "peak_memory": 1}
    return {**whole, **changes}


@pytest.mark.parametrize(
    ("contents", "reason"),
    [
        ({"type": "progress", "fraction": math.nan, "score": None}, "fraction is nan"),
        ({"type": "progress", "fraction": 1.5, "score": None}, "fraction is 1.5"),
        ({"type": "progress", "fraction": 0.5, "score": math.nan}, "score is nan"),
        ({"type": "progress", "fraction": 0.5}, "score is missing"),
        (_metric(None), "step is None"),
        (_metric(2**70), f"step is {2**70}"),
        (_metric(-1), "step is -1"),
        (_metric(1.5), "step is 1.5"),
        (_metric(True), "step is True"),
        (_metric(1, **{"\ud800": 1.0}), "'\\ud800'"),
        (_metric(1, **{"a\0b": 1.0}), "'a\\x00b'"),
        (_metric(1, **{"x" * 101: 1.0}), "at most 100 characters"),
        (_metric(1, large=10**400), "values.large is 1000"),
        ({"type": "milestone", "step": 1, "score": math.inf, "params": ""}, "score is inf"),
        ({"type": "milestone", "step": 1, "score": 1.0, "params": "AAAA"}, "They are no finite numbers"),
        ({"type": "milestone", "step": 1, "score": 1.0, "params": "AAAAAAAA+H8="}, "They are no finite numbers"),
        ({"type": "checkpoint", "data": "abc"}, "data is 'abc'"),
        (_done(finals=[["score", math.nan, "m"]]), "finals.0.1 is nan"),
        (_done(finals=[["score", 1.0, "m" * 31]]), "at most 30 characters"),
        (_done(params=[0.0, -math.inf]), "params.1 is -inf"),
        (_done(peak_memory=2**63), "peak_memory"),
        ({"type": "gossip"}, "'gossip', which is no message"),
        ({"type": ["done"]}, "['done'], which is no message"),
    ],
)
def test_what_no_database_could_hold_is_refused(contents: dict[str, Any], reason: str) -> None:
    """With what was given and what was expected."""
    with pytest.raises(RefusedMessageError) as error:
        read_message(json.dumps(contents).encode())
    assert reason in str(error.value)


def test_deep_data_is_refused() -> None:
    """However deep: no interpreter's limit is met."""
    with pytest.raises(RefusedMessageError, match="nested too deep"):
        read_message(b'{"type":"metric","step":' + b"[" * 100_000)


@pytest.mark.parametrize("line", [b'{"type":"met', b"", b"3", b"[]", b'"word"', b"\xff"])
def test_other_lines_are_no_messages(line: bytes) -> None:
    """Such as one that a kill has cut off."""
    assert read_message(line) is None


def test_what_can_be_kept_comes_through() -> None:
    """Every bit of a number, NaN on a learning curve, and the words of a reason, but for what is no text."""
    metric = read_message(json.dumps(_metric(3, third=1 / 3, count=2, gap=math.nan)).encode())
    assert isinstance(metric, MetricMessage)
    assert (metric.values["third"].hex(), metric.values["count"]) == ((1 / 3).hex(), 2.0)
    assert math.isnan(metric.values["gap"])
    word = {"type": "failed", "reason": "no file \ud800", "traceback": "", "peak_memory": None}
    failed = read_message(json.dumps(word).encode())
    assert isinstance(failed, FailedMessage)
    assert failed.reason == "no file ?"


@pytest.mark.slow
@pytest.mark.parametrize(
    "refused",
    [
        # all are refused as above, before they reach a database: here an integer and the last message of a run
        pytest.param({"large-step": f"step is {2**70}", "nan-params": "params.0 is nan"}, id="whole-and-last"),
        pytest.param({"nan-progress": "fraction is nan"}, id="progress"),
    ],
)
def test_a_message_that_cannot_be_kept_fails_its_run_alone(refused: dict[str, str], tmp_path: Path) -> None:
    """FAILED with what was given; the earlier messages are kept, and the next run is done."""
    path = tmp_path / "zoo.db"  # what is refused reaches no database, of whatever kind
    *wrong, right = work_on_fakes(path, len(refused) + 1, child=bad(*refused))
    assert right.state is RunState.DONE
    with Store(path) as store:
        for run, (oddity, reason) in zip(wrong, refused.items(), strict=True):
            assert run.state is RunState.FAILED, oddity
            assert reason in (run.reason or ""), oddity
            assert [point.value for point in store.metrics(run.id, "position")] == [1.0], oddity
            assert store.finals(run.id) == [], oddity
            assert [attempt.outcome for attempt in store.attempts(run.id)] == [RunState.FAILED], oddity


@pytest.mark.slow
def test_a_message_that_is_too_long_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And not taken into memory."""
    monkeypatch.setattr(process, "LONGEST_MESSAGE", 10_000)
    wrong, right = work_on_fakes(tmp_path / "zoo.db", 2, child=bad("nested"))
    assert (wrong.state, right.state) == (RunState.FAILED, RunState.DONE)
    assert "more than 10,000 bytes" in (wrong.reason or "")
