"""`zoobench verify bench`: what it measures, writes, reads and compares."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from tests.verify.bench.rows import cost_row, rate_row, results, run_share
from zoobench.errors import ZoobenchError
from zoobench_verify.bench import bench as measuring
from zoobench_verify.bench import bench_rows, cpp_reference, run_shares
from zoobench_verify.bench.bench import BenchCase
from zoobench_verify.bench.bench_rows import CostRow, RateRow, RunShare


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[BenchCase | str]:
    """Measure nothing: the cases and runs that were asked for, each at 6 M/s or with three quarters in kernels."""
    asked: list[BenchCase | str] = []

    def bench(wanted: list[BenchCase], on_case: Callable[[BenchCase], None]) -> Iterator[tuple[RateRow, CostRow]]:
        for case in wanted:
            on_case(case)
            asked.append(case)
            if case.asked == 666:
                raise ZoobenchError("The machine is on fire.")
            own = {"precision": case.precision, "worlds": case.worlds}
            yield rate_row(case.scene, case.asked, **own), cost_row(case.scene, case.asked, **own)

    def run(options: str) -> RunShare:
        asked.append(options)
        return run_share(options)

    monkeypatch.setattr(measuring, "bench", bench)
    monkeypatch.setattr(run_shares, "measure_run", run)
    monkeypatch.setattr(cpp_reference, "build", lambda: Path("reference"))
    return asked


def test_options_reach_the_cases(zoobench: Command, measured: list[BenchCase]) -> None:
    """Every scene at every number of particles, with the C++ reference, which is compiled once."""
    scenes = ("--scenes", "ice,ground", "--particles", "1000,2000")
    settings = ("--no-gradients", "--precision", "64", "--worlds", "3", "--repeats", "2", "--frames", "7")
    reply = zoobench("verify", "bench", *scenes, *settings)
    assert reply.code == 0
    assert [(case.scene, case.asked) for case in measured] == [
        ("ice", 1000), ("ice", 2000), ("ground", 1000), ("ground", 2000)
    ]  # fmt: skip
    assert measured[0] == BenchCase(
        "ice", 1000, 64, gradients=False, repeats=2, frames=7, worlds=3, reference="reference"
    )
    assert reply.err.startswith("[1/4, 0 s] ice, ")


def test_json_is_the_whole_document(zoobench: Command, measured: list[BenchCase]) -> None:
    """Machine, rates, costs and growth with every field; what is printed can be read again."""
    reply = zoobench("verify", "bench", "--scenes", "ice", "--particles", "1000,2000", "--format", "json")
    document = json.loads(reply.out)
    assert document["rates"][0] == vars(rate_row("ice", 1000))
    assert document["costs"][1] == vars(cost_row("ice", 2000))
    assert [row["exponent"] for row in document["growth"]] == pytest.approx([1.0, 1.0], abs=1e-2)
    assert {"measured", "zoobench", "code", "cpu", "memory"} <= document["machine"].keys()
    assert "host" not in document["machine"]  # results are published
    Path("again.json").write_text(reply.out)
    again = json.loads(zoobench("verify", "bench", "--from", "again.json", "--format", "json").out)
    assert again == document
    assert len(measured) == 2


def test_a_table_shows_rates_with_their_spread_and_leaves_out_what_is_empty(
    zoobench: Command, measured: list[BenchCase]
) -> None:
    """People read tables of a few columns; programs find every field of one of them as CSV."""
    out = zoobench("verify", "bench", "--scenes", "ice").out
    assert "6.0 (5.4 to 6.6)" in out
    assert "advance_launch_us" in out
    assert "exponent" not in out
    lines = zoobench("verify", "bench", "--scenes", "ice", "--table", "rates", "--format", "csv").out.splitlines()
    assert lines[0].split(",") == list(vars(rate_row()))
    assert len(measured) == 2


def test_runs_are_measured_instead_of_scenes_unless_both_are_asked_for(
    zoobench: Command, measured: list[BenchCase | str]
) -> None:
    """`--run` can be given several times."""
    reply = zoobench("verify", "bench", "--run", "--env ice", "--run", "--env ground", "--format", "json")
    assert measured == ["--env ice", "--env ground"]
    assert [run["kernel_share"] for run in json.loads(reply.out)["runs"]] == [0.75, 0.75]
    measured.clear()
    zoobench("verify", "bench", "--run", "--env ice", "--scenes", "ice")
    assert [type(each) for each in measured] == [BenchCase, str]


def test_results_are_kept_as_they_come(zoobench: Command, measured: list[BenchCase]) -> None:
    """What was measured before a failure is in the file, and can be shown."""
    reply = zoobench("verify", "bench", "--scenes", "ice", "--particles", "1000,666", "--output", "kept/bench.json")
    assert reply.code == 2
    assert "on fire" in reply.err
    assert [row.asked for row in bench_rows.read(Path("kept/bench.json")).rates] == [1000]
    assert len(measured) == 2


def test_results_are_compared_with_those_of_a_file(zoobench: Command, measured: list[BenchCase]) -> None:
    """Ratios of the same cases; other cases are said to have none."""
    old = results(rates=(rate_row(forward=3.0),), runs=(run_share("--env ice", cpu_s=50.0),))
    Path("old.json").write_text(json.dumps(old.to_dict()))
    words = ("verify", "bench", "--against", "old.json", "--format", "json", "--scenes", "ground")
    document = json.loads(zoobench(*words, "--run", "--env ice").out)
    assert [(row["scene"], row["forward"], row["compile_cold"]) for row in document["ratios"]] == [("ground", 2.0, 1.0)]
    assert document["run-ratios"][0]["cpu"] == 2.0
    other = zoobench(*words, "--precision", "64")
    assert json.loads(other.out)["ratios"] == []
    assert "Nothing to compare" in other.err
    assert len(measured) == 3


@pytest.mark.parametrize("option", ["--against", "--from"])
def test_another_file_is_refused_before_anything_is_measured(
    zoobench: Command, measured: list[BenchCase], option: str
) -> None:
    """Exit code 2, and a message that says what is wrong with it."""
    Path("other.json").write_text('{"machine": {}, "rates": [{"scene": "ice"}]}')
    reply = zoobench("verify", "bench", "--scenes", "ice", option, "other.json")
    assert reply.code == 2
    assert "rates.0.asked: Field required" in reply.err
    assert measured == []


def test_without_a_compiler_it_goes_on(
    zoobench: Command, measured: list[BenchCase], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line says so."""

    def fail() -> Path:
        raise cpp_reference.NoReferenceError("There is no C++ compiler.")

    monkeypatch.setattr(cpp_reference, "build", fail)
    reply = zoobench("verify", "bench", "--scenes", "ice")
    assert reply.code == 0
    assert "There is no C++ compiler. Rates are not compared" in reply.err
    assert measured[0].reference == ""


def test_several_files_are_shown_together(zoobench: Command) -> None:
    """As if they had been measured at once: their growth follows from all of them."""
    for name, asked in (("a.json", 10_000), ("b.json", 1000)):
        Path(name).write_text(json.dumps(results(rates=(rate_row(asked=asked),), costs=()).to_dict()))
    document = json.loads(zoobench("verify", "bench", "--from", "a.json", "--from", "b.json", "--format", "json").out)
    assert [row["asked"] for row in document["rates"]] == [10_000, 1000]
    assert [row["most"] for row in document["growth"]] == [9996, 9996]
    assert len(document["runs"]) == 2
    assert document["machine"] == results().machine


def test_rates_and_shares_are_drawn(zoobench: Command) -> None:
    """One picture of both; nothing to draw is said."""
    pytest.importorskip("matplotlib")
    Path("bench.json").write_text(json.dumps(results().to_dict()))
    assert zoobench("verify", "bench", "--from", "bench.json", "--plot", "plots/bench.png").code == 0
    assert Path("plots/bench.png").read_bytes().startswith(b"\x89PNG")
    Path("empty.json").write_text(json.dumps(results(rates=(), costs=(), runs=()).to_dict()))
    reply = zoobench("verify", "bench", "--from", "empty.json", "--plot", "plots/empty.png")
    assert (reply.code, "nothing to draw" in reply.err) == (2, True)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--table", "speed"], "rates, costs, growth, runs, ratios, run-ratios"),
        (["--format", "csv"], "Choose one with --table"),
        (["--particles", "10"], "10 particles cannot be measured"),
        (["--output", "."], "No results can be written"),
    ],
)
def test_wrong_options_are_refused(
    zoobench: Command, measured: list[BenchCase], words: list[str], message: str
) -> None:
    """With exit code 2."""
    reply = zoobench("verify", "bench", "--scenes", "ice", *words)
    assert reply.code == 2
    assert message in reply.err
    assert measured == []
