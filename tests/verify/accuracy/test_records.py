"""Measurements survive their file."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.verify.accuracy.study import balance, close, cost, ladder, sample
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.verify.accuracy.records import (
    COST_STUDY,
    ENERGY_STUDY,
    from_reader,
    label,
    read,
    stored,
    variant_of,
    write,
)


def test_a_file_gives_back_what_was_written(tmp_path: Path) -> None:
    """Seven digits of every number, NaN included, and every reference."""
    measured = ladder(close=close("draft", 0.001), broken=sample("paper[courant=0.9]", [0.1, float("nan")]))
    measured = replace(measured, balances=(balance("draft", 0.1),))
    write(measured, tmp_path / "measured.json")
    back = read(tmp_path / "measured.json")
    assert back.origin == measured.origin
    assert back.costs == measured.costs
    assert back.balances == measured.balances == (balance("draft", 0.1),)
    for one, two in zip(back.samples, measured.samples, strict=True):
        assert (one.env, one.fidelity, one.frames) == (two.env, two.fidelity, two.frames)
        np.testing.assert_allclose(list(one.scores.values()), list(two.scores.values()), rtol=1e-6)
        assert one.is_close == two.is_close
        np.testing.assert_allclose(one.paths.ravel(), two.paths.ravel(), rtol=1e-6)


def test_of_stored_costs_and_balances_the_newest_count(tmp_path: Path) -> None:
    """A case measured again replaces the earlier one; null in the database is NaN."""
    with Store(tmp_path / "some.db") as store:
        for contact, rate in ((0.1, 100.0), (0.2, 200.0)):
            for study, item in ((ENERGY_STUDY, balance("draft", contact)), (COST_STUDY, cost("draft", rate))):
                list(store.save_study(study, [stored(item)], provenance={}))
        list(store.save_study(COST_STUDY, [stored(replace(cost("paper", 1.0), gradient=math.nan))], provenance={}))
        found = from_reader(store)
    assert found.balances == (balance("draft", 0.2),)
    assert found.costs[0] == cost("draft", 200.0)
    assert math.isnan(found.costs[1].gradient)


def test_a_label_says_what_is_not_the_default() -> None:
    """Level, then knob, then a changed environment."""
    one = sample("standard[courant=0.9]", [0.0], env="ocean[bulk_modulus=4e5]")
    assert label(Kind.FIDELITY, one.fidelity) == "standard[courant=0.9]"
    assert variant_of(one) == "standard[courant=0.9] ocean[bulk_modulus=400000.0]"
    assert stored(ladder().costs[0]).case == "ground draft"
    assert stored(balance("draft[transfer=pic]", 0.1)).case == "ground draft[transfer=pic]"


BROKEN = (
    '"samples": [{"env": "ground", "fidelity": "draft", "scores": []}], "costs": []',
    '"samples": [], "costs": ["ground"]',
    '"samples": [{"env": "no name", "fidelity": "draft", "scores": {}, "slopes": [], "paths": [], "spreads": []}]',
)


@pytest.mark.parametrize(
    "text", ["", "{}", '{"format": 99}', "[1, 2]", *(f'{{"format": 1, {rest}, "origin": []}}' for rest in BROKEN)]
)
def test_a_file_of_another_kind_is_refused(tmp_path: Path, text: str) -> None:
    """Clearly, whatever it holds."""
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(UsageError, match=r"other\.json"):
        read(path)
    with pytest.raises(UsageError, match="Cannot read"):
        read(tmp_path / "missing.json")
