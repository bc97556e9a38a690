"""The results of `bench` in a file: what was written is read, and nothing else is."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.verify.bench.rows import results
from zoobench.errors import UsageError
from zoobench.verify.bench.bench_rows import BenchResults, read


def test_what_was_written_is_read(tmp_path: Path) -> None:
    """Every field of every row, those without a value too, and whatever else a document holds is left out."""
    path = tmp_path / "bench.json"
    path.write_text(json.dumps(results().to_dict() | {"growth": [{"exponent": 1.0}]}))
    assert read(path) == results()


def test_numbers_may_be_whole() -> None:
    """JSON of another program may write 6 for 6.0."""
    data = results().to_dict()
    data["rates"][0]["forward_mps"] = 6
    assert BenchResults.from_dict(data).rates[0].forward_mps == 6


def spoilt(table: str, name: str, value: Any) -> str:
    """A document with one wrong field; without it if the value is `...`."""
    data = results().to_dict()
    if value is ...:
        del data[table][0][name]
    else:
        data[table][0][name] = value
    return json.dumps(data)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("no json", "Expecting value"),
        ("[]", "no object with a `machine`"),
        ('{"machine": "old"}', "no object with a `machine`"),
        ('{"machine": {}, "rates": [3]}', "3 is no row of RateRow"),
        ('{"machine": {}, "rates": 3}', "3 is no list of RateRow"),
        (spoilt("rates", "asked", ...), "a row of RateRow has no asked"),
        (spoilt("rates", "scene", 3), "scene is 3, where text belongs"),
        (spoilt("rates", "forward_mps", "fast"), "forward_mps is 'fast', where a number belongs"),
        (spoilt("rates", "forward_mps", True), "forward_mps is True, where a number belongs"),
        (spoilt("costs", "peak_memory_mib", "300"), "where a number or null belongs"),
        (spoilt("costs", "asked", 1.5), "asked is 1.5, where a whole number belongs"),
        (spoilt("runs", "cpu_s", None), "cpu_s is None, where a number belongs"),
    ],
)
def test_another_file_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """The message says what is wrong and how to make such a file."""
    path = tmp_path / "bench.json"
    path.write_text(text)
    with pytest.raises(UsageError, match="zoobench bench --output") as refusal:
        read(path)
    assert message in str(refusal.value)


def test_a_file_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    """And so is a folder."""
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(UsageError, match="holds no results"):
            read(path)
