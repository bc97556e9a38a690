"""Rows of studies are in the database before their results are handed on."""

from pathlib import Path

from zoobench.cli.studies import save_each
from zoobench.db.query import Reader
from zoobench.db.rows import StudyRow


def stored(path: Path) -> tuple[list[str], bool]:
    """Cases of the study `squares`, and whether it is finished."""
    with Reader(path, create=False) as reader:
        study = reader.study("squares")
    assert study is not None
    return [row.case for row in study.rows], study.finished_at is not None


def test_each_result_is_stored_before_it_is_yielded(tmp_path: Path) -> None:
    """The study is finished with its last row, not before."""
    path = tmp_path / "some.db"
    results = save_each(str(path), "squares", (n * n for n in (1, 2)), lambda n: StudyRow(str(n), "measured", {}))
    assert next(results) == 1
    assert stored(path) == (["1"], False)
    assert list(results) == [4]
    assert stored(path) == (["1", "4"], True)
