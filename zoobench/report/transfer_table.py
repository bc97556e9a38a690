"""The transfer matrix: scores of solutions in the environments where they were found and in others."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any

from zoobench.report.labels import labels
from zoobench.report.listing import Listing
from zoobench.report.provisional import marked
from zoobench.report.run_results import SMOKE
from zoobench.report.statistics import t_interval
from zoobench.spec import Ref

Document = Mapping[str, Any]
"""A row of the study, with the `controller` and the `budget` of its run where they are known."""

_COLUMNS = ("task", "fidelity", "design", "method", "found_in", "frames")
_ALL = (*_COLUMNS, "found_for", "found_at", "controller", "budget")
_REFS = tuple(place for place, name in enumerate(_ALL) if name not in ("frames", "budget"))


def newest(documents: Iterable[Document]) -> list[Document]:
    """The last row of every run, place and episode length."""
    last = {tuple(row[name] for name in ("env", "task", "fidelity", "frames", "run")): row for row in documents}
    return [last[key] for key in sorted(last, key=str)]


def transfer_matrix(documents: Iterable[Document]) -> Listing:
    """A row for each task, fidelity, design, method and home, a column for each environment in which it was tried.

    Runs that were found for another task, at another fidelity, with another controller or budget have rows of their
    own, and a column that says so. A cell holds the mean score over runs with half of its 95 % interval, and their
    number; the place where they were found is bold. Smoke runs are left out.
    """
    rows = [row for row in newest(documents) if SMOKE not in (_name(row["fidelity"]), _name(row["home"][2]))]
    envs = sorted({row["env"] for row in rows})
    groups: dict[tuple[str, ...], dict[str, list[Document]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        groups[_of_row(row)][row["env"]].append(row)
    usual = range(len(_COLUMNS))
    telling = [place for place in range(len(_COLUMNS), len(_ALL)) if len({key[place] for key in groups}) > 1]
    names = labels(Ref.parse(text) for key in groups for place in _REFS for text in [key[place]] if text)
    names = marked(names | labels(Ref.parse(env) for env in envs))
    body, bold = [], set()
    for number, (key, by_env) in enumerate(sorted(groups.items())):
        words = [names[Ref.parse(text)] if place in _REFS and text else text for place, text in enumerate(key)]
        shown = [int(words[place]) if _ALL[place] == "frames" else words[place] for place in (*usual, *telling)]
        body.append((*shown, *(_cell(by_env[env]) for env in envs)))
        bold |= {(number, len(shown) + place) for place, env in enumerate(envs) if _is_home(key, env)}
    columns = (*_COLUMNS, *(_ALL[place] for place in telling), *(names[Ref.parse(env)] for env in envs))
    return Listing(columns, tuple(body), frozenset(bold))


def _of_row(row: Document) -> tuple[str, ...]:
    """The key of a matrix row, in the order of `_ALL`."""
    env, task, fidelity = row["home"]
    tried = (row[name] for name in ("task", "fidelity", "design", "method"))
    return (*tried, env, str(row["frames"]), task, fidelity, row.get("controller", ""), row.get("budget", ""))


def _is_home(key: tuple[str, ...], env: str) -> bool:
    """Whether the solutions of a row were found in this environment, for its task and at its fidelity."""
    of = dict(zip(_ALL, key, strict=True))
    return (env, of["task"], of["fidelity"]) == (of["found_in"], of["found_for"], of["found_at"])


def _name(text: str) -> str:
    return Ref.parse(text).name


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
