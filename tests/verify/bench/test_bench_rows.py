"""The results of `bench` in a file: what was written is read, and nothing else is."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.verify.bench.rows import results
from zoobench.errors import UsageError
from zoobench_verify.bench.bench_rows import read


def test_what_was_written_is_read(tmp_path: Path) -> None:
    """Every field of every row, those without a value too, and whatever else a document holds is left out."""
    path = tmp_path / "bench.json"
    path.write_text(json.dumps(results().to_dict() | {"growth": [{"exponent": 1.0}]}))
    assert read(path) == results()


def test_numbers_may_be_whole(tmp_path: Path) -> None:
    """JSON of another program may write 6 for 6.0."""
    path = tmp_path / "bench.json"
    path.write_text(spoilt("rates", "forward_mps", 6))
    assert read(path).rates[0].forward_mps == 6


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
        ("no json", "Invalid JSON"),
        ("[]", "Input should be an object"),
        ("{}", "machine: Field required"),
        ('{"machine": "old"}', "machine: Input should be an object"),
        ('{"machine": {}, "rates": [3]}', "rates.0: Input should be an object"),
        ('{"machine": {}, "rates": 3}', "rates: Input should be a valid array"),
        (spoilt("rates", "asked", ...), "rates.0.asked: Field required"),
        (spoilt("rates", "scene", 3), "rates.0.scene: Input should be a valid string"),
        (spoilt("rates", "forward_mps", "fast"), "rates.0.forward_mps: Input should be a valid number"),
        (spoilt("rates", "forward_mps", True), "rates.0.forward_mps: Input should be a valid number"),
        (spoilt("costs", "peak_memory_mib", "300"), "costs.0.peak_memory_mib: Input should be a valid number"),
        (spoilt("costs", "asked", 1.5), "costs.0.asked: Input should be a valid integer"),
        (spoilt("runs", "cpu_s", None), "runs.0.cpu_s: Input should be a valid number"),
    ],
)
def test_another_file_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """The message says what is wrong and how to make such a file."""
    path = tmp_path / "bench.json"
    path.write_text(text)
    with pytest.raises(UsageError, match="zoobench verify bench --output") as refusal:
        read(path)
    assert message in str(refusal.value)


def test_a_file_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    """And so is a folder."""
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(UsageError, match="holds no results"):
            read(path)
