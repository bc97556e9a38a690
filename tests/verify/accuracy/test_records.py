"""Measurements survive their file."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.verify.accuracy.study import balance, ladder, sample
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.registry import Kind, short
from zoobench.spec import Ref
from zoobench_verify.accuracy.plan import StudyPlan, evaluations, trainings
from zoobench_verify.accuracy.records import ENERGY_STUDY, from_reader, read, stored, write


def test_a_file_gives_back_what_was_written(tmp_path: Path) -> None:
    """Seven digits of every number, and every reference."""
    measured = ladder(others=[sample("draft", {"e@0": 0.125}, slopes={"e@0": [0.5, -0.25]})])
    measured = replace(measured, balances=(balance("draft", 0.1),))
    write(measured, tmp_path / "measured.json")
    back = read(tmp_path / "measured.json")
    assert (back.origin, back.balances) == (measured.origin, measured.balances)
    assert back.samples[-1] == measured.samples[-1]
    for one, two in zip(back.samples, measured.samples, strict=True):
        assert replace(one, scores={}) == replace(two, scores={})
        assert one.scores == pytest.approx(two.scores, rel=1e-6)


def test_of_stored_balances_the_newest_counts(tmp_path: Path) -> None:
    """A case measured again replaces the earlier one."""
    with Store(tmp_path / "some.db") as store:
        for contact in (0.1, 0.2):
            list(store.save_study(ENERGY_STUDY, [stored(balance("draft", contact))], provenance={}))
        found = from_reader(store)
    assert found.balances == (balance("draft", 0.2),)
    assert found.samples == ()


def test_a_label_says_what_is_not_the_default() -> None:
    """Level, then knob."""
    one = sample("standard[courant=0.25]", {}, env="ocean[water=particles,bulk_modulus=4e5]")
    assert short(Kind.FIDELITY, one.fidelity) == "standard[courant=0.25]"
    assert short(Kind.ENV, one.env) == "ocean[bulk_modulus=400000.0,water=particles]"
    assert stored(balance("draft[transfer=pic]", 0.1)).case == "ground draft[transfer=pic]"


BROKEN = (
    '"samples": [{"env": "ground", "fidelity": "draft", "scores": []}]',
    '"samples": [5]',
    '"samples": "many"',
    '"samples": [], "balances": 7',
    '"samples": [], "origin": [], "balances": [{"env": "?"}]',
)


@pytest.mark.parametrize(
    "content", ["not json", "[]", "{}", '{"format": 2}', *(f'{{"format": 3, {b}}}' for b in BROKEN)]
)
def test_a_file_of_another_kind_is_refused(tmp_path: Path, content: str) -> None:
    """With its name, and what to give."""
    path = tmp_path / "other.json"
    path.write_text(content)
    with pytest.raises(UsageError, match=r"other\.json holds no accuracy measurements"):
        read(path)


def test_gaits_are_read_from_a_run_under_the_names_of_their_trainings(tmp_path: Path) -> None:
    """Two trainings, one gait of each: a score, a gradient, and times without those of episodes that compile."""
    (first, second, *_) = trained = trainings([Ref("ice")], [Ref("turning")], StudyPlan(), [Ref("panda")])
    probe = next(spec for spec in evaluations(trained, StudyPlan()) if spec.method.kwargs["gradients"] == 2)
    readings = {
        "run": [0, 1, 0, 1, 0, 1], "stage": [3, 3, 4, 4, 5, 5], "particles": [9.0] * 6,
        "cpu_seconds": [8.0, 3.0, 7.0, 1.0, 1.0, 2.0], "score_current": [0.1, 0.2, 0.3, 0.4, 0.5],
    }  # fmt: skip
    metrics = {(name, step): value for name, values in readings.items() for step, value in enumerate(values, start=1)}
    metrics |= {("slope_1", 0): 0.5, ("slope_1", 1): -0.5}
    with Store(tmp_path / "some.db") as store:
        store.enqueue([*trained[:2], probe])
        for _ in trained[:2]:
            claim = store.claim(Owner("here", "place", 1, 1, 0), provenance={})
            assert claim is not None
            store.finish(claim, Ending(RunState.DONE, params=(1.0,)), Batch())
        claim = store.claim(Owner("here", "place", 1, 1, 0), provenance={})
        assert claim is not None
        assert {start.spec for start in claim.stored} == {first, second}
        totals = (FinalRow("forward_substeps", 4800.0), FinalRow("episodes", 6.0))
        store.finish(claim, Ending(RunState.DONE, params=(1.0,), finals=totals), Batch(metrics=metrics))
        (found,) = from_reader(store).samples
    one, two = (spec.key()[:16] for spec in (first, second))
    assert (found.found, found.particles, found.substeps) == ("draft", 9, 1000.0)
    assert found.scores == {f"{one}@3": 0.1, f"{two}@3": 0.2, f"{one}@4": 0.3, f"{two}@4": 0.4, f"{one}@5": 0.5}
    assert found.slopes == {f"{two}@3": [0.5, -0.5]}
    assert found.gradient_seconds == {f"{two}@3": 3.0}
    assert found.seconds == {f"{two}@4": 1.0, f"{one}@5": 1.0, f"{two}@5": 2.0}
