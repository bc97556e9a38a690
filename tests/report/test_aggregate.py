"""Methods over all rows of a table, from figures that can be computed by hand."""

from pathlib import Path

import pytest

from tests.report.content import add_done, add_ended, make_spec
from zoobench.db.rows import Ending, RunState
from zoobench.db.store import Store
from zoobench.report.aggregate import Aggregates, aggregate, aggregate_listing, aggregate_records
from zoobench.report.listing import cell_text
from zoobench.report.run_results import choose_results
from zoobench.report.tables import score_tables
from zoobench.spec import RunSelection

GOOD, BAD = "diffphysics-v2[lr=0.1]", "random-v1"
ROWS = {  # floor 0, so that a share is the score by the best mean of its row
    "desert-v1": {GOOD: (9.0, 10.0, 11.0), BAD: (0.0, 5.0, 10.0)},
    "ice-v1": {GOOD: (1.0, 1.0, 1.0), BAD: (0.5, 1.0, 1.0)},
}


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Aggregates:
    """The two rows of `ROWS`, and one in which a seed of the better method has failed."""
    with Store(tmp_path_factory.mktemp("aggregate") / "runs.db") as store:
        for env, methods in ROWS.items():
            for method, scores in methods.items():
                for seed, score in enumerate(scores):
                    spec = make_spec(env=env, method=method, seed=seed)
                    add_done(store, spec, score, references={"idle_score": 0.0, "random_score": -1.0})
        for method, seed in ((GOOD, 0), (BAD, 0), (BAD, 1)):
            add_done(store, make_spec(env="snow-v1", method=method, seed=seed), 1.0)
        add_ended(store, make_spec(env="snow-v1", seed=1), Ending(RunState.FAILED, "no"))
        (table,) = score_tables(choose_results(store, RunSelection()))
    return aggregate(table)


def by_name(found: Aggregates) -> dict[str, float]:
    """Interquartile means by the name of the method."""
    return {entry.method.name: estimate.value for entry, estimate in found.means.items()}


def test_the_interquartile_mean_is_that_of_the_middle_half_over_complete_rows(found: Aggregates) -> None:
    """Of 0.9, 1, 1, 1, 1, 1.1 and of 0, 0.5, 0.5, 1, 1, 1 the lowest and the highest quarter are cut."""
    assert found.rows == 2
    assert by_name(found) == {"diffphysics": pytest.approx(1.0), "random": pytest.approx((0.5 + 0.5 + 1 + 1) / 4)}


def test_the_probability_of_improvement_counts_pairs_within_rows(found: Aggregates) -> None:
    """On the desert 7.5 of 9 pairs (one tie), on ice 6 of 9 (six ties); the mean over the two rows."""
    named = {
        (one.method.name, other.method.name): estimate.value for (one, other), estimate in found.improvements.items()
    }
    desert, ice = (3 + 3 + 1 + 0.5) / 9, (3 + 6 * 0.5) / 9
    assert named["diffphysics", "random"] == pytest.approx((desert + ice) / 2)
    assert named["random", "diffphysics"] == pytest.approx(1 - (desert + ice) / 2)


def test_a_profile_falls_from_all_runs_to_none(found: Aggregates) -> None:
    """The share of runs above a threshold: random has 5 of 6 above 0, and none above 1.25."""
    profile = next(profile for profile in found.profiles if profile.entry.method.name == "random")
    shares = [estimate.value for estimate in profile.shares]
    assert shares[0] == pytest.approx(5 / 6)
    assert shares[-1] == 0.0
    assert shares == sorted(shares, reverse=True)
    assert all(one.low is not None and one.high is not None and one.low <= one.value <= one.high
               for one in profile.shares)  # fmt: skip


def test_intervals_come_from_the_seeds_within_rows(found: Aggregates) -> None:
    """They hold the value, and the same data give the same interval; equal seeds in all rows give none."""
    (estimate,) = (estimate for entry, estimate in found.means.items() if entry.method.name == "random")
    assert estimate.low is not None
    assert estimate.high is not None
    assert 0.16 < estimate.low < estimate.value < estimate.high <= 1.0
    assert aggregate(found.table) == found


def test_the_listing_names_what_a_method_is_compared_with(found: Aggregates) -> None:
    """A row for each method; nothing is said of a method and itself."""
    listing = aggregate_listing(found)
    assert listing.columns == ("method", "rows", "IQM", "better than diffphysics", "better than random")
    assert listing.rows[0][3] is None
    assert listing.reading()[0][2].startswith("1.00")


def test_programs_get_a_row_for_each_figure(found: Aggregates) -> None:
    """Numbers with the ends of their intervals, and whom they compare."""
    records = aggregate_records(found).records()
    assert [record["statistic"] for record in records] == ["IQM", "IQM", "improvement", "improvement"]
    assert records[1]["low"] < records[1]["value"] < records[1]["high"]
    assert (records[2]["method"], records[2]["other"], records[2]["rows"]) == (GOOD, BAD, 2)


def test_one_seed_gives_no_interval(tmp_path: Path) -> None:
    """Nothing can be resampled."""
    with Store(tmp_path / "runs.db") as store:
        for method, score in ((GOOD, 2.0), (BAD, 1.0)):
            add_done(store, make_spec(method=method), score, references={"idle_score": 0.0, "random_score": 0.0})
        (table,) = score_tables(choose_results(store, RunSelection()))
    assert {cell_text(found) for found in aggregate(table).means.values()} == {"1", "0.5"}
