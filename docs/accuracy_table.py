"""Write the table of docs/accuracy.md from the published measurements: `python docs/accuracy_table.py`."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "accuracy.md"

_PLACES = {
    "ground": "ground", "ice": "ice", "desert": "sand", "snow": "snow", "clay": "clay", "wetland": "mud",
    "ocean": "ocean",
}  # fmt: skip
_LEVELS = ("draft", "standard", "paper")
_BEGIN, _END = "<!-- accuracy_table.py -->\n\n", "\n<!-- end -->\n"


def table() -> str:
    """A row for each place: moving, what its levels err by, what they decide and what they cost."""
    rows = json.loads((ROOT / "zoobench/verify/accuracy/published.json").read_text(encoding="utf-8"))["levels"]
    found = {(row["env"], row["fidelity"]): row for row in rows if row["task"] == "movement-speed"}
    head = (
        "place", "error of the speed [%]", "two gaits of one animal: order known above [%]",
        "two animals: order known above [%]", "CPU s per simulated s",
    )  # fmt: skip
    lines = ["| " + " | ".join(head) + " |", len(head) * "| --- " + "|"]
    for env, name in _PLACES.items():
        levels = [row for level in _LEVELS if (row := found.get((env, level))) and row["error"] is not None]
        if levels:
            cells = (
                _joined(_percent(row["error"]) for row in levels),
                _margins(row["one_body"] for row in levels),
                _margins(row["two_bodies"] for row in levels),
                _joined(f"{row['seconds']:.2g}" for row in levels),
            )
            lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def page() -> str:
    """The page with the table of today."""
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(_BEGIN)
    return f"{before}{_BEGIN}{table()}{_END}{rest.split(_END)[1]}"


def _margins(orders: Iterable[dict[str, Any]]) -> str:
    orders = list(orders)
    if not any(order["pairs"] for order in orders):
        return "not measured"
    known = ["?" if order["ratio"] is None else _percent(order["ratio"] - 1.0) for order in orders]
    return _joined(known)


def _percent(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g}"


def _joined(texts: Iterable[str]) -> str:
    return " / ".join(texts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
