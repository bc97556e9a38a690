"""Suites and leaderboards from the command line: run, publish, check, repeat."""

import csv
import errno
import io
import json
import shlex
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Command, Reply
from tests.report.boards import board, unknown
from tests.report.content import add_done
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.harness import suites
from zoobench.report.leaderboard import BoardRow
from zoobench.report.leaderboard_files import publish
from zoobench.spec import RunSpec
from zoobench.studies import transfer_study
from zoobench.studies.transfer_study import MisfitError, TransferRow, TransferTargets

COMMITTED = Path(__file__).parents[2] / "leaderboards"

TINY = """
summary: a robot for two frames
grids:
  - envs: ground
    tasks: movement-speed
    designs: caterpillar
    controllers: sine-basis
    methods: ["random[batch=1]", "cmaes[population=4]"]
    seeds: 1
    budget: 1 iterations
    fidelity: draft
    frames: 2
"""


@pytest.fixture
def boards(tmp_path: Path) -> Path:
    """A folder with the published leaderboard `mine`."""
    publish(board(tmp_path), tmp_path / "boards", unknown)
    return tmp_path / "boards"


def ok(reply: Reply) -> Reply:
    """The reply of a command that went well."""
    assert reply.code == 0, reply.err
    return reply


def scores(text: str) -> dict[str, Any]:
    """Final scores by key, from `results --format json`."""
    return {run["key"]: run["finals"]["score"] for run in json.loads(text)}


@pytest.mark.slow  # the tests below do each step with runs that are none
def test_a_suite_is_run_published_checked_and_repeated(zoobench: Command, tmp_path: Path) -> None:
    """From a file to its leaderboard; the command in a row makes the same number, bit for bit, elsewhere."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    ok(zoobench("run", "--suite", "tiny.yaml", "--method", "random", "-j", "1"))
    ok(zoobench("leaderboard", "publish", "tiny.yaml"))
    assert sorted(path.name for path in (tmp_path / "leaderboards").iterdir()) == ["tiny.csv", "tiny.json", "tiny.md"]
    assert "tiny" in ok(zoobench("leaderboard", "check")).err

    page = (tmp_path / "leaderboards" / "tiny.md").read_text(encoding="utf-8")
    assert "- Runs: 1 done, 1 missing, of 2;" in page
    assert "| ground | movement-speed | caterpillar | missing |" in page
    rows = csv.DictReader(io.StringIO((tmp_path / "leaderboards" / "tiny.csv").read_text(encoding="utf-8")))
    (command,) = [row["repeat"] for row in rows if row["n"] == "1"]
    ok(zoobench(*shlex.split(command)[1:], "--db", "again.db"))
    first = scores(ok(zoobench("results", "--format", "json")).out)

    assert "at paper: score" in ok(zoobench("leaderboard", "confirm", "tiny.yaml")).err
    again = ok(zoobench("leaderboard", "confirm", "tiny.yaml")).err
    assert "at paper" not in again, "it is not done again"
    assert "over 6 frames" not in again
    ok(zoobench("leaderboard", "publish", "tiny.yaml"))
    assert "| 3x |" in (tmp_path / "leaderboards" / "tiny.md").read_text(encoding="utf-8")
    runs = json.loads((tmp_path / "leaderboards" / "tiny.json").read_text(encoding="utf-8"))["runs"]
    assert [run["finer"]["fidelity"].partition("-")[0] for run in runs if run["state"] == "done"] == ["paper"]
    (lasting,) = (run.pop("lasting") for run in runs if run["state"] == "done")
    assert lasting["frames"] == 6
    assert lasting["home_gap"] > 5.0

    export = tmp_path / "leaderboards" / "tiny.json"
    document = json.loads(export.read_text(encoding="utf-8"))
    export.write_text(json.dumps({**document, "runs": runs}), encoding="utf-8")
    ok(zoobench("leaderboard", "rebuild"))
    assert "3x" not in (tmp_path / "leaderboards" / "tiny.md").read_text(encoding="utf-8")
    assert "over 6 frames" in ok(zoobench("leaderboard", "confirm", "tiny", "--from", "leaderboards")).err
    assert [run["lasting"] for run in json.loads(export.read_text())["runs"] if run["state"] == "done"] == [lasting]
    ok(zoobench("leaderboard", "check"))
    refused = zoobench("leaderboard", "confirm", "huge", "--from", "leaderboards")
    assert (refused.code, "There is no export huge.json" in refused.err) == (2, True)
    assert scores(ok(zoobench("results", "--format", "json", "--db", "again.db")).out) == first
    assert len(first) == 1


@pytest.mark.slow
def test_what_has_no_place_on_a_finer_grid_is_left_out(
    zoobench: Command, tmp_path: Path, pretend: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a word, once; the others are evaluated."""

    def transfer(run: int, spec: RunSpec, params: object, targets: TransferTargets) -> Iterator[TransferRow]:
        if run == 1:
            raise MisfitError("The 3 parameters of run 1 do not fit.")
        (cell,) = targets.of(spec)
        home = (str(spec.env), str(spec.task), str(spec.fidelity))
        yield TransferRow(
            run, str(spec.design), str(spec.method), spec.seed, home, str(cell.env), str(cell.task), str(cell.fidelity),
            cell.frames, 0.5, "m/s", "",
        )  # fmt: skip

    pretend()
    monkeypatch.setattr(transfer_study, "transfer", transfer)
    (tmp_path / "tiny.yaml").write_text(TINY)
    ok(zoobench("run", "--suite", "tiny.yaml", "-j", "1"))
    told = ok(zoobench("leaderboard", "confirm", "tiny.yaml")).err
    assert told.count("Left out: The 3 parameters of run 1 do not fit.") == 1
    assert "run 2 at paper: score 0.5 m/s" in told
    assert "run 1 over 6 frames: not defined: Parameters of shape (1, 1)" in told


def test_a_leaderboard_grows_over_databases(zoobench: Command, tmp_path: Path, pretend: Callable[..., None]) -> None:
    """A seed from one database, another from a second: the page holds both; a file that is no export is not lost."""
    pretend()
    (tmp_path / "tiny.yaml").write_text(TINY.replace("seeds: 1", "seeds: 2"))
    publishing = ("leaderboard", "publish", "tiny.yaml", "leaderboards")
    for seed in (0, 1):
        run = ("run", "--suite", "tiny.yaml", "--method", "random", "--seeds", f"{seed},", "-j", "1")
        ok(zoobench(*run, "--db", f"{seed}.db"))
        ok(zoobench(*publishing, "--db", f"{seed}.db"))
    assert "- Runs: 2 done, 2 missing, of 4;" in (tmp_path / "leaderboards" / "tiny.md").read_text(encoding="utf-8")
    ok(zoobench("leaderboard", "check"))

    (tmp_path / "tiny.yaml").write_text(TINY)
    assert "Left out: 1 run of the earlier export" in ok(zoobench(*publishing, "--db", "0.db")).err

    (tmp_path / "leaderboards" / "tiny.json").write_text("mine")
    refused = zoobench(*publishing, "--db", "1.db")
    assert refused.code == 2
    assert "no export" in refused.err
    assert (tmp_path / "leaderboards" / "tiny.json").read_text() == "mine"


def test_animals_that_cannot_be_ranked_are_told(zoobench: Command, tmp_path: Path) -> None:
    """By what is published of the fidelity: in the terminal, on the page, and on the page made anew."""
    (tmp_path / "tiny.yaml").write_text(TINY.replace("designs: caterpillar", "designs: [caterpillar, panda]"))
    with Store(tmp_path / "zoobench.db") as store:
        for cell in suites.load(str(tmp_path / "tiny.yaml")).cells:
            add_done(store, suites.spec_of(cell), 1.0)
    told = "not that of caterpillar and panda"
    assert told in ok(zoobench("leaderboard", "show", "tiny.yaml")).out
    ok(zoobench("leaderboard", "publish", "tiny.yaml"))
    assert told in (tmp_path / "leaderboards" / "tiny.md").read_text(encoding="utf-8")
    assert "nothing was written" in ok(zoobench("leaderboard", "rebuild")).err


def test_a_done_run_is_not_lost_to_one_that_failed(boards: Path, tmp_path: Path) -> None:
    """What was done once and published stays, whatever became of the same run in another database."""
    before = (boards / "mine.md").read_text(encoding="utf-8")
    newer = board(tmp_path)
    rows = tuple(
        BoardRow(entry.spec, RunState.TIMEOUT, "too slow") if entry.state is RunState.DONE else entry
        for entry in newer.rows
    )
    publish(replace(newer, rows=rows), boards, unknown)
    assert (boards / "mine.md").read_text(encoding="utf-8") == before


def test_published_runs_that_are_not_asked_for_any_more_are_counted(boards: Path, tmp_path: Path) -> None:
    """A suite that has become smaller, or another of the same name: nothing leaves a leaderboard in silence."""
    whole = board(tmp_path)
    assert [publish(replace(whole, rows=whole.rows[1:]), boards, unknown).left_out for _ in range(2)] == [1, 0]


def test_a_full_disk_leaves_the_published_files_as_they_were(
    boards: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The export may be the only one that knows a run: it is replaced by a whole one or not at all."""
    before = {path: path.read_bytes() for path in boards.iterdir()}

    def write_half(path: Path, content: bytes) -> int:
        with path.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", write_half)
    smaller = board(tmp_path)
    with pytest.raises(UsageError, match="No space left"):
        publish(replace(smaller, rows=smaller.rows[1:]), boards, unknown)
    assert {path: path.read_bytes() for path in boards.iterdir()} == before


def test_check_names_the_first_line_that_differs(zoobench: Command, boards: Path) -> None:
    """In the Markdown, in the CSV, and where the export itself is written in another form."""
    assert "mine" in ok(zoobench("leaderboard", "check", boards)).err
    for name, old, new in (
        ("mine.md", "3 seeds", "4 seeds"),
        ("mine.csv", "0.101", "0.201"),
        ("mine.json", ":{", ": {"),
    ):
        path = boards / name
        text = path.read_text(encoding="utf-8")
        number = text[: text.index(old)].count("\n") + 1
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
        reply = zoobench("leaderboard", "check", boards)
        assert reply.code == 1
        assert f"{path}, line {number} differs: there is" in reply.err
        assert old in reply.err
        assert new in reply.err
        path.write_text(text, encoding="utf-8")
    ok(zoobench("leaderboard", "check", boards))


def test_a_score_changed_in_the_export_shows_in_its_pages(zoobench: Command, boards: Path) -> None:
    """Whoever edits a number has two other files to explain."""
    path = boards / "mine.json"
    text = path.read_text(encoding="utf-8")
    assert '"value":1.002' in text
    path.write_text(text.replace('"value":1.002', '"value":1.902', 1), encoding="utf-8")
    reply = zoobench("leaderboard", "check", boards)
    assert reply.code == 1
    assert "mine.md, line" in reply.err
    assert "mine.csv, line" in reply.err


def test_check_misses_pages_and_exports(zoobench: Command, boards: Path) -> None:
    """A page that is gone, and one whose export is."""
    (boards / "mine.md").rename(boards / "mine.txt")
    shutil.copy(boards / "mine.csv", boards / "other.csv")
    reply = zoobench("leaderboard", "check", boards)
    assert reply.code == 1
    assert "mine.md is missing" in reply.err
    assert "other.csv has no export other.json" in reply.err


def test_an_export_that_cannot_be_read_is_exit_code_two(zoobench: Command, boards: Path) -> None:
    """Broken JSON, bytes that are no text, and a folder without any."""
    for content in (b"{", b"\xff", b"[]"):
        (boards / "mine.json").write_bytes(content)
        reply = zoobench("leaderboard", "check", boards)
        assert reply.code == 2
        assert "mine.json" in reply.err
    reply = zoobench("leaderboard", "check", boards / "empty")
    assert reply.code == 2
    assert "There is no export" in reply.err


def test_the_committed_leaderboards_are_what_their_exports_make_of_them(zoobench: Command) -> None:
    """Byte for byte, all that were published."""
    assert {"codesign.json", "design.json", "gaits.json"} <= {path.name for path in COMMITTED.iterdir()}
    ok(zoobench("leaderboard", "check", COMMITTED))


@pytest.mark.slow
def test_a_suite_is_printed_with_what_is_missing(zoobench: Command, database: Path) -> None:
    """Nothing of the suite `gaits` is in the database: no table, and how much is missing."""
    reply = ok(zoobench("leaderboard", "show", "gaits", "--format", "json"))
    assert json.loads(reply.out)["cells"] == []
    assert "651 runs of the suite are missing; 70 rows without any run are not shown" in reply.err


def test_suites_are_listed(zoobench: Command) -> None:
    """Alone, and with everything else; they have no version."""
    records = json.loads(zoobench("list", "suites", "--format", "json").out)
    parts = [f"paper/{name}" for name in ("animals", "reinforcement", "control", "design", "codesign")]
    names = ["codesign", "control", "design", "gaits", "manipulation", "paper", *parts]
    names += ["shallows", "skills", "smoke"]
    assert [record["name"] for record in records] == names
    assert {record["version"] for record in records} == {None}
    assert all(record in json.loads(zoobench("list", "--format", "json").out) for record in records)


@pytest.mark.slow
def test_plan_says_what_each_part_of_a_suite_costs(zoobench: Command) -> None:
    """In computing on one core, with what the estimate rests on, before anything is queued."""
    reply = ok(zoobench("run", "--dry-run", "--suite", "paper", "--env", "ground,ice", "--seeds", "1"))
    lines = reply.err.splitlines()
    assert [line.split()[1] for line in lines if line.startswith("  part")] == [
        "animals:",
        "reinforcement:",
        "control:",
    ]
    assert "  part animals: 64 runs, 22 h" in reply.err
    assert any("by measured rates (animals on one core of AMD EPYC" in line for line in lines)
    assert "Memory: up to" in lines[-1]


def test_plan_shows_a_part_of_a_suite(zoobench: Command) -> None:
    """What the other options leave of it, in its order."""
    reply = ok(
        zoobench("run", "--dry-run", "--suite", "design", "--method", "neat,random", "--seeds", "1", "--format", "json")
    )
    runs = [tuple(run[axis].partition("-v")[0] for axis in ("design", "method")) for run in json.loads(reply.out)]
    assert runs[:4] == [("particle", "neat"), ("particle", "random"), ("voxel", "neat"), ("voxel", "random")]
    assert len(runs) == 8


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "--dry-run"], "Nothing is chosen by --env and --task"),
        (["run", "--env", "ice"], "Nothing is chosen by --task"),
        (["run", "--dry-run", "--suite", "gates"], "Did you mean 'gaits'"),
        (["run", "--dry-run", "--suite", "gaits", "--env", "lake"], "Unknown env in the suite 'gaits': 'lake'"),
        (["run", "--suite", "gaits", "--smoke"], "A suite states every setting. Leave --smoke out"),
        (["run", "--suite", "gaits", "--preset", "paper", "--tolerance", "1"], "Leave --preset and --tolerance out"),
        (["leaderboard", "show", "smoke"], "no table shows those"),
        (["leaderboard", "show", "gaits", "--env", "ice"], "No such option: --env"),
        (["leaderboard", "publish"], "Missing argument"),
        (["leaderboard", "publish", "gaits", "zoobench.db"], "Cannot write a leaderboard into 'zoobench.db'"),
    ],
)
def test_what_goes_not_together_is_refused(zoobench: Command, database: Path, words: list[str], message: str) -> None:
    """Exit code 2 and what to do."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert message in reply.err


def test_there_is_no_leaderboard_without_a_database(zoobench: Command, tmp_path: Path) -> None:
    """Nothing is written, not even a page on which all is missing."""
    assert zoobench("leaderboard", "publish", "gaits", "boards").code == 2
    assert not (tmp_path / "boards").exists()


def test_pages_of_an_earlier_form_are_rebuilt_from_their_exports(zoobench: Command, boards: Path) -> None:
    """Both pages are as they were published, and the export is not touched; a second time nothing is written."""
    before = {path: path.read_bytes() for path in boards.iterdir()}
    (boards / "mine.md").unlink()
    (boards / "mine.csv").write_text("an earlier form", encoding="utf-8")
    reply = ok(zoobench("leaderboard", "rebuild", boards))
    assert reply.err.count("Written") == 2
    assert {path: path.read_bytes() for path in boards.iterdir()} == before
    assert "nothing was written" in ok(zoobench("leaderboard", "rebuild", boards)).err
