"""The export of a leaderboard: all that it holds as one text.

The export is JSON in one canonical form: a line for each provenance, component and run, keys sorted; seeds of a cell
that no run exists for share a line. Equal content is equal text, so that committed files can be compared byte for
byte.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from zoobench.db.published import cell_of
from zoobench.db.rows import FinalRow, RunState
from zoobench.errors import UsageError
from zoobench.report.curve import Curve
from zoobench.report.lasting import Lasting
from zoobench.report.leaderboard import MISSING, Attempt, BoardRow, FinerScore, Leaderboard
from zoobench.report.run_results import SMOKE, finals_record
from zoobench.spec import AXES, Ref, RunSpec, canonical_json

FORMAT = 1


def to_text(board: Leaderboard) -> str:
    """The export."""
    documents: list[Mapping[str, Any]] = []
    components: list[Mapping[str, Any]] = []
    runs: list[dict[str, Any]] = []
    for row in board.rows:
        cell = _cell(row.spec, components)
        if row.state is not None:
            runs.append(_record(row, cell, documents))
        elif runs and runs[-1]["state"] == MISSING and runs[-1]["spec"] == cell:
            runs[-1]["seeds"].append(row.spec.seed)
        else:
            runs.append({"spec": cell, "state": MISSING, "seeds": [row.spec.seed]})
    suite = {"name": board.name, "source": board.source, "summary": board.summary}
    lines = [
        f'"format":{FORMAT}',
        f'"suite":{canonical_json(suite)}',
        f'"provenance":{_lines(documents)}',
        f'"components":{_lines(components)}',
        f'"runs":{_lines(runs)}',
    ]
    return "{" + ",\n".join(lines) + "}\n"


def from_text(text: str, where: str) -> Leaderboard:
    """The inverse of `to_text`; `where` names the file in messages.

    Raises:
        UsageError: this is no export, or one of another format, or a run's key is not that of its settings.
    """
    try:
        document = json.loads(text, parse_constant=_refuse_constant)
        if document["format"] != FORMAT:
            raise UsageError(f"its format is {document['format']!r}, and this zoobench reads {FORMAT}")
        suite, documents, components = document["suite"], document["provenance"], document["components"]
        rows = tuple(row for record in document["runs"] for row in _rows_of(record, documents, components))
        _check_rows(rows)
        return Leaderboard(str(suite["name"]), str(suite["source"]), str(suite["summary"]), rows)
    except (UsageError, ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise UsageError(
            f"{where} is no export of a leaderboard: {what}. `zoobench leaderboard publish SUITE DIR` writes one."
        ) from None


def _cell(spec: RunSpec, components: list[Mapping[str, Any]]) -> dict[str, Any]:
    """A spec without its seed; each component is its place in the list, which grows."""
    plain = spec.to_dict()
    del plain["seed"]
    return plain | {axis: _place(plain[axis], components) for axis in AXES}


def _record(row: BoardRow, cell: Mapping[str, Any], documents: list[Mapping[str, Any]]) -> dict[str, Any]:
    """A run that exists as JSON data; its provenance is the place of a document in the list, which grows."""
    optional: dict[str, Any] = {} if row.solution is None else {"solution": row.solution}
    if row.finer is not None:
        optional["finer"] = {"fidelity": str(row.finer.fidelity), "score": row.finer.score}
    if row.lasting is not None:
        optional["lasting"] = row.lasting.document()
    if row.curve is not None:
        optional["curve"] = {"spent": row.curve.spent, "scores": row.curve.scores}
    return {
        **optional,
        "key": row.spec.key(),
        "spec": cell,
        "seed": row.spec.seed,
        "state": str(row.state),
        "reason": row.reason,
        "seconds": round(row.seconds, 3),
        "finals": finals_record(row.finals),
        "attempts": [
            {
                "started_at": round(attempt.started_at, 3),
                "ended_at": None if attempt.ended_at is None else round(attempt.ended_at, 3),
                "resumed": attempt.resumed,
                "provenance": _place(attempt.provenance, documents),
            }
            for attempt in row.attempts
        ],
    }


def _rows_of(
    record: Mapping[str, Any], documents: Sequence[Mapping[str, Any]], components: Sequence[Mapping[str, Any]]
) -> Iterator[BoardRow]:
    """The runs of a line: one that exists, or those that do not."""
    cell = cell_of(record, components)
    if record["state"] == MISSING:
        yield from (BoardRow(RunSpec.from_dict({**cell, "seed": seed})) for seed in record["seeds"])
    else:
        yield _row_of(record, RunSpec.from_dict({**cell, "seed": record["seed"]}), documents)


def _row_of(record: Mapping[str, Any], spec: RunSpec, documents: Sequence[Mapping[str, Any]]) -> BoardRow:
    if spec.key() != record["key"]:
        raise UsageError(f"the key {str(record['key'])[:12]} is not that of {spec}")
    state = RunState(record["state"])
    finals = {
        name: FinalRow(name, math.nan if item["value"] is None else float(item["value"]), str(item["unit"]))
        for name, item in record["finals"].items()
    }
    attempts = tuple(
        Attempt(
            float(item["started_at"]),
            None if item["ended_at"] is None else float(item["ended_at"]),
            item["resumed"],
            _checked_origin(documents[item["provenance"]]),
        )
        for item in record["attempts"]
    )
    solution = None if (given := record.get("solution")) is None else tuple(map(float, given))
    finer = None
    if (given := record.get("finer")) is not None:
        score = given["score"]
        finer = FinerScore(Ref.parse(given["fidelity"]), None if score is None else float(score))
    curve = None if (given := record.get("curve")) is None else _curve(given)
    lasting = None if (given := record.get("lasting")) is None else Lasting.from_document(given)
    return BoardRow(
        spec, state, record["reason"], float(record["seconds"]), finals, attempts, solution, finer, curve, lasting
    )


def _curve(document: Mapping[str, Any]) -> Curve:
    spent, scores = (tuple(map(float, document[name])) for name in ("spent", "scores"))
    if len(spent) != len(scores) or list(spent) != sorted(spent):
        raise UsageError(f"a curve has {len(scores)} scores at {len(spent)} amounts spent, or these fall")
    return Curve(spent, scores)


def _checked_origin(document: Mapping[str, Any]) -> Mapping[str, Any]:
    kinds = {"code": dict, "cpu": dict, "packages": dict, "gpus": list}
    for name, kind in kinds.items():
        if not isinstance(document.get(name, kind()), kind):
            raise UsageError(f"the origin has {name} {document[name]!r}")
    return document


def _check_rows(rows: Iterable[BoardRow]) -> None:
    seen: set[str] = set()
    for row in rows:
        key, _ = row.spec.key(), hash(row.spec)  # TypeError: a parameter is no plain value
        if key in seen:
            raise UsageError(f"{row.spec} comes twice")
        if row.spec.fidelity.name == SMOKE:
            raise UsageError(f"{row.spec} is a smoke run, whose numbers mean nothing")
        if row.finals and row.state is not RunState.DONE:
            raise UsageError(f"{row.spec} is {row.state or MISSING} and has results")
        if row.state is RunState.DONE and not row.attempts:
            raise UsageError(f"{row.spec} is done, and no attempt says where")
        seen.add(key)


def _place(document: Mapping[str, Any], documents: list[Mapping[str, Any]]) -> int:
    """Where a document is in the list, which grows if it is new."""
    if document not in documents:
        documents.append(document)
    return documents.index(document)


def _lines(items: Sequence[Any]) -> str:
    """A JSON list with an item on each line."""
    return "[\n" + ",\n".join(map(canonical_json, items)) + "\n]" if items else "[]"


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no JSON")
