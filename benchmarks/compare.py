"""The speed of this checkout by that of another one, measured in turn.

    python benchmarks/compare.py ../other --env ground,desert
    python benchmarks/compare.py ../other --rounds 3 --run '--env ground --task turning'

All options but --rounds are those of `zoobench verify bench`, which each round starts in both checkouts, so that other
work on the machine slows both. For each row it prints the ratio of this checkout's numbers to the other's: the median
of the rounds, their least and their largest. Of rates, above 1 is faster; of seconds (_s), below 1.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import median
from typing import Any

HERE = Path(__file__).parents[1]
_COMPARED = ("forward_fps", "gradient_fps", "cpu_s", "wall_s")

Rows = dict[str, dict[str, Any]]
"""The rows that a checkout printed, by what they are of."""


def main() -> None:
    """Measure both checkouts and print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the other checkout")
    parser.add_argument("--rounds", type=int, default=5)
    given, options = parser.parse_known_args()
    options = options if "--run" in options else ["--repeats", "1", *options]
    rounds = [tuple(measured(root, options) for root in (HERE, given.other.absolute())) for _ in range(given.rounds)]
    print("\n".join(lines(rounds)))


def measured(root: Path, options: list[str]) -> Rows:
    """What `zoobench verify bench` of a checkout prints."""
    done = subprocess.run(
        [sys.executable, "-m", "zoobench", "verify", "bench", *options, "--format", "json"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(root), str(root / "verify")])},
        stdout=subprocess.PIPE,
        check=True,
    )
    return {row.get("env") or row["command"]: row for row in json.loads(done.stdout)}


def lines(rounds: list[tuple[Rows, Rows]]) -> list[str]:
    """A line for each number that both checkouts have."""
    found = []
    for name, row in rounds[0][0].items():
        for what in _COMPARED:
            if row.get(what) and all(rows.get(name, {}).get(what) for each in rounds for rows in each):
                ratios = [mine[name][what] / other[name][what] for mine, other in rounds]
                found.append(f"{name}, {what}: {median(ratios):.3f} ({min(ratios):.3f} to {max(ratios):.3f})")
    return found


if __name__ == "__main__":
    main()
