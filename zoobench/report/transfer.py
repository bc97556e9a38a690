"""The transfer matrix: how what was found in one environment does in the others."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from zoobench.report.labels import labels
from zoobench.report.listing import Listing
from zoobench.report.statistics import t_interval
from zoobench.spec import Ref

Document = Mapping[str, Any]


def newest(documents: Iterable[Document]) -> list[Document]:
    """The last row of every run, place and episode length."""
    last = {(*_place(row), row["frames"], row["run"]): row for row in documents}
    return [last[key] for key in sorted(last, key=str)]


def transfer_matrix(documents: Iterable[Document]) -> Listing:
    """A row for each task, fidelity, design, method and home, a column for each environment in which it was tried.

    A cell holds the mean score over runs with half of its 95 % interval, and their number; the home environment's is
    stressed.
    """
    rows = newest(documents)
    envs = sorted({row["env"] for row in rows})
    groups: dict[tuple[str, ...], dict[str, list[Document]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        groups[tuple(_of_row(row))][row["env"]].append(row)
    names = labels(Ref.parse(text) for key in groups for text in key[:5]) | labels(Ref.parse(env) for env in envs)
    body, bold = [], set()
    for number, (key, by_env) in enumerate(sorted(groups.items())):
        *refs, frames = key
        body.append((*(names[Ref.parse(text)] for text in refs), int(frames), *(_cell(by_env[env]) for env in envs)))
        bold |= {(number, len(key) + place) for place, env in enumerate(envs) if env == key[4]}
    columns = ("task", "fidelity", "design", "method", "found_in", "frames", *(names[Ref.parse(env)] for env in envs))
    return Listing(columns, tuple(body), frozenset(bold))


def _of_row(row: Document) -> Iterator[str]:
    """What the row of a matrix is about."""
    yield from (row[name] for name in ("task", "fidelity", "design", "method"))
    yield row["home"][0]
    yield str(row["frames"])


def _place(row: Document) -> tuple[str, str, str]:
    return row["env"], row["task"], row["fidelity"]


def _cell(rows: list[Document]) -> str | None:
    """Mean and interval of the scores, and how many runs had none."""
    if not rows:
        return None
    scores = [row["score"] for row in rows if row["score"] is not None]
    lost = len(rows) - len(scores)
    interval = t_interval(scores)
    if interval is None:
        return f"{lost} diverged"
    spread = "" if interval.half_width is None else f" ± {interval.half_width:.2g}"
    missing = f", {lost} diverged" if lost else ""
    return f"{interval.mean:.4g}{spread} {rows[0]['unit']} (n={interval.count}{missing})"
