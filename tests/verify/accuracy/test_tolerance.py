"""The cheapest fidelity that is accurate enough."""

import errno
import json
from pathlib import Path

import pytest

from tests.verify.accuracy.study import TASK, ladder, sample, scores
from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.verify.accuracy import tolerance
from zoobench.verify.accuracy.records import Measurements


@pytest.fixture(autouse=True)
def _measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Made-up measurements of ground, published, in the place of those that come with the package."""
    tolerance.publish(ladder(), tmp_path / tolerance.PUBLISHED)
    monkeypatch.setattr(tolerance, "files", lambda package: tmp_path)
    tolerance.published.cache_clear()


def test_what_comes_with_the_package_can_be_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every environment has levels with errors and costs, and says which commit measured it."""
    monkeypatch.undo()
    tolerance.published.cache_clear()
    found = tolerance.published()
    tolerance.published.cache_clear()
    assert found.origin
    assert {Ref.parse(text).name for text in found.components} == set(registry.names(Kind.ENV))
    assert all(row.seconds for row in found.levels if row.fidelity in ("draft", "standard"))


def test_the_coarsest_level_within_the_tolerance_is_chosen() -> None:
    """The law's errors at 1/64 to 1/192 are 0.72, 0.48, 0.36 and 0.24, each uncertain by 1.25 x 0.24.

    Of four controllers, they are 2.37 times as large at most at 95 %: chi^2 with 4 degrees of freedom exceeds 0.7107
    then.
    """
    assert tolerance.choose(Ref("ground"), TASK, 1.8).fidelity == Ref("draft")
    chosen = tolerance.choose(Ref("ground"), TASK, 1.0)
    assert chosen.fidelity == Ref("paper")
    assert "error of 0.36 (below 0.85 at 95%" in chosen.reason
    assert "s per simulated second" in chosen.reason


def test_what_no_level_reaches_is_refused_with_the_best_figure() -> None:
    """The figure is the least tolerance that could be met."""
    with pytest.raises(UsageError, match=r"fine with an error of 0\.24"):
        tolerance.choose(Ref("ground"), TASK, 0.1)


@pytest.mark.parametrize("env", ["ice", "ground[friction=0.1]"])
def test_what_was_not_measured_as_it_is_now_is_refused(env: str) -> None:
    """Another environment, or another ground."""
    with pytest.raises(UsageError, match="was not measured"):
        tolerance.choose(Ref.parse(env), TASK, 0.5)


def test_another_task_and_nonsense_are_refused() -> None:
    """With advice."""
    with pytest.raises(UsageError, match="was not measured"):
        tolerance.choose(Ref("ground"), "turning", 0.5)
    with pytest.raises(UsageError, match="cannot be met"):
        tolerance.choose(Ref("ground"), TASK, -1.0)


def test_environments_that_were_not_measured_again_stay_as_they_are(tmp_path: Path) -> None:
    """Ice after ground: the file has both; ground again: its rows are replaced, not doubled."""
    path = tmp_path / tolerance.PUBLISHED
    before = json.loads(path.read_text())
    tolerance.publish(Measurements((sample("draft", scores("draft"), env="ice"),), (), ("later",)), path)
    both = json.loads(path.read_text())
    assert {row["env"] for row in both["levels"]} == {"ground", "ice"}
    assert [row for row in both["levels"] if row["env"] == "ground"] == before["levels"]
    assert both["origin"] == ["later", "made up"]
    tolerance.publish(ladder(), path)
    assert json.loads(path.read_text())["levels"] == both["levels"]


def test_a_full_disk_leaves_the_file_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It may hold the only results of an environment: it is replaced by a whole file or not at all."""
    path = tmp_path / tolerance.PUBLISHED
    before = path.read_text()

    def write_half(file: Path, content: str | bytes, **others: str) -> int:
        with file.open("w" if isinstance(content, str) else "wb") as opened:
            opened.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", write_half)
    monkeypatch.setattr(Path, "write_bytes", write_half)
    with pytest.raises(UsageError, match="No space left"):
        tolerance.publish(ladder(), path)
    assert path.read_text() == before


@pytest.mark.parametrize("components", [None, [5], ["no name"]])
def test_another_file_is_not_overwritten(tmp_path: Path, components: object) -> None:
    """A file of another kind is refused and stays unchanged."""
    path = tmp_path / "notes.json"
    text = json.dumps({"mine": 1} if components is None else {"levels": [], "origin": [], "components": components})
    path.write_text(text)
    with pytest.raises(UsageError, match="something else"):
        tolerance.publish(ladder(), path)
    assert path.read_text() == text
