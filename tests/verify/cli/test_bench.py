"""`zoobench verify bench`: what it measures and prints."""

import csv
import io
import json

import pytest

from tests.cli.conftest import Command
from zoobench.spec import Ref
from zoobench_verify.bench import speed
from zoobench_verify.bench.speed import EpisodeRate, Speed

RATE = EpisodeRate(1200.0, 900.0, 1300.0, 6.5)


@pytest.fixture(autouse=True)
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Measure nothing: what was asked for, each at 1200 frames per second."""
    found: list[tuple[str, ...]] = []

    def measure(env: Ref, fidelity: Ref, *, worlds: int, gradients: bool, repeats: int) -> Speed:
        found.append((env.name, str(fidelity), str(worlds), str(repeats)))
        return Speed(str(env), str(fidelity), worlds, 428, 100, RATE, RATE if gradients else None)

    monkeypatch.setattr(speed, "measure", measure)
    return found


def test_every_environment_is_measured_at_draft(zoobench: Command, asked: list[tuple[str, ...]]) -> None:
    """Or those that are named, as they are asked for."""
    assert zoobench("verify", "bench").code == 0
    assert len(asked) == 8
    assert set(asked) >= {("ground", "draft", "1", "5"), ("ocean", "draft", "1", "5")}
    zoobench("verify", "bench", "--env", "ice", "--fidelity", "standard", "--worlds", "4", "--repeats", "2")
    assert asked[-1] == ("ice", "standard", "4", "2")


def test_people_and_programs_have_the_rates(zoobench: Command) -> None:
    """People with their spread, programs in columns of numbers, with the commit and the processor."""
    table = zoobench("verify", "bench", "--env", "ice")
    assert "1200 (900 to 1300)" in table.out
    (row,) = csv.DictReader(io.StringIO(zoobench("verify", "bench", "--env", "ice", "--format", "csv").out))
    assert (row["env"], row["forward_fps"], row["gradient_mps"]) == ("ice", "1200.0", "6.5")
    assert row["processor"]
    (forward,) = json.loads(zoobench("verify", "bench", "--env", "ice", "--no-gradients", "--format", "json").out)
    assert (forward["forward_fps"], forward["gradient_fps"]) == (1200.0, None)
