"""The file that --tolerance and --decide read, as a study writes it."""

import errno
import json
from pathlib import Path

import pytest

from tests.verify.accuracy.study import LIMITS, ladder, sample, scaled
from zoobench.accuracy.levels import PUBLISHED
from zoobench.errors import UsageError
from zoobench_verify.accuracy.publishing import write_levels
from zoobench_verify.accuracy.records import Measurements


def test_places_that_were_not_measured_again_stay_as_they_are(tmp_path: Path) -> None:
    """Ice after ground: the file has both; ground again: its rows are replaced, not doubled."""
    path = tmp_path / PUBLISHED
    write_levels(ladder(), path)
    before = json.loads(path.read_text())
    write_levels(Measurements((sample("draft", scaled(1.0), env="ice"),), ("later",)), path)
    both = json.loads(path.read_text())
    assert {row["env"] for row in both["levels"]} == {"ground", "ice"}
    assert [row for row in both["levels"] if row["env"] == "ground"] == before["levels"]
    assert both["origin"] == ["later", "made up"]
    write_levels(ladder(), path)
    assert json.loads(path.read_text())["levels"] == both["levels"]


def test_a_full_disk_leaves_the_file_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It may hold the only results of an environment: it is replaced by a whole file or not at all."""
    path = tmp_path / PUBLISHED
    write_levels(ladder(), path)
    before = path.read_text()

    def write_half(file: Path, content: str | bytes, **others: str) -> int:
        with file.open("w" if isinstance(content, str) else "wb") as opened:
            opened.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", write_half)
    monkeypatch.setattr(Path, "write_bytes", write_half)
    with pytest.raises(UsageError, match="No space left"):
        write_levels(ladder(), path)
    assert path.read_text() == before


@pytest.mark.parametrize("content", [{"mine": 1}, {"levels": [5], "origin": []}])
def test_another_file_is_not_overwritten(tmp_path: Path, content: object) -> None:
    """A file of another kind is refused and stays unchanged."""
    path = tmp_path / "notes.json"
    text = json.dumps(content)
    path.write_text(text)
    with pytest.raises(UsageError, match="something else"):
        write_levels(ladder(), path)
    assert path.read_text() == text


def test_a_level_that_only_verified_a_reference_is_not_published(tmp_path: Path) -> None:
    """At it one gait of sixteen was evaluated: it is in the others' errors, and no level to choose."""
    finer = sample("fine", {gait: 1.2 * score for gait, score in list(LIMITS.items())[-1:]})
    write_levels(ladder(others=[finer]), tmp_path / PUBLISHED)
    rows = json.loads((tmp_path / PUBLISHED).read_text())["levels"]
    assert [row["fidelity"] for row in rows] == ["draft", "standard", "paper"]
    assert {row["checked"] for row in rows} == {1}
