"""Write the tables of pages from what was published: `python docs/tables.py`.

A table stands between `<!-- tables.py: NAME -->` and `<!-- end -->`.
"""

import csv
import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from itertools import product
from pathlib import Path
from statistics import fmean

from zoobench.accuracy.levels import KeptOrders, LevelRow
from zoobench.accuracy.tolerance import known_levels
from zoobench.report.leaderboard_export import from_text
from zoobench.spec import Ref

ROOT = Path(__file__).parents[1]
PAGES = (
    "README.md",
    "docs/performance.md",
    "docs/accuracy.md",
    "docs/accuracy-beds.md",
    "docs/accuracy-contact.md",
    "docs/accuracy-rest-frame.md",
    "docs/accuracy-judge.md",
    "docs/accuracy-objects.md",
    "docs/guide/objects.md",
    "docs/guide/results.md",
    "docs/guide/results-bodies.md",
)

_PLACES = {
    "ground": "ground", "ice": "ice", "desert": "sand", "snow": "snow", "clay": "clay", "wetland": "mud",
    "ocean": "ocean", "ocean[water=grid]": "ocean, water on a grid",
}  # fmt: skip
_LEVELS = ("draft", "standard", "paper")
_ANIMALS = ("caterpillar", "baby-seal", "panda", "fish")
_TASKS = {"movement-speed": "moving", "turning": "turning"}
_MARKED = re.compile(r"(<!-- tables.py: ([a-z-]+) -->\n\n).*?(\n<!-- end -->)", re.DOTALL)


def accuracy() -> str:
    """A row for each place: moving, what its levels err by, what they decide and what they cost."""
    body = []
    for place, levels in _levels_of("movement-speed").items():
        body.append((
            place,
            f"{_joined(_percent(row.error) for row in levels)} ± {_known(levels[0].unknown)}",
            _margins(row.one_body for row in levels),
            _margins(row.two_bodies for row in levels),
            _joined(f"{row.seconds:.2g}" for row in levels),
        ))  # fmt: skip
    head = (
        "place", "error of the speed ± that of the finest grid [%]", "two gaits of one animal: order known above [%]",
        "two animals: order known above [%]", "CPU s per simulated s",
    )  # fmt: skip
    return _table(head, body)


def paths() -> str:
    """By place: above which ratio two scores of a task with a path keep their order at `standard`."""
    tasks = [_levels_of(task) for task in ("velocity-tracking", "waypoint-following")]
    body = [
        (place, *(_ratio(row.one_body) for levels in tasks for row in levels[place] if row.fidelity == "standard"))
        for place in tasks[0]
        if place in tasks[1]
    ]
    return _table(("place", "velocity", "waypoints"), body)


def turns() -> str:
    """By soil and level: what turns of each animal differ by from the finest grid's, and what order of two is known."""
    body = [
        (place, row.fidelity, *(_percent(row.bodies[name]) for name in _ANIMALS), _margins([row.two_bodies]))
        for place, levels in _levels_of("turning").items()
        if place in ("clay", "mud")
        for row in levels
    ]
    animals = (f"{name.replace('-', ' ')} [%]" for name in _ANIMALS)
    return _table(("soil", "level", *animals, "two animals: order known above [%]"), body)


def _levels_of(task: str) -> dict[str, list[LevelRow]]:
    """The levels of each place whose error is known in its present version, from coarse to fine."""
    known = known_levels(map(Ref.parse, _PLACES), [task])
    found = {
        place: [row for row in known if row.env == env and row.fidelity in _LEVELS] for env, place in _PLACES.items()
    }
    return {place: levels for place, levels in found.items() if levels}


def softness() -> str:
    """By the soil's yield stress: what levels differ by from `paper`, for three animals and for the fish."""
    with (ROOT / "docs/softness.csv").open(encoding="utf-8", newline="") as file:
        scores = {tuple(row.values())[:-1]: float(row["score_mm_s"]) for row in csv.DictReader(file)}
    body = []
    for bed, stress in dict.fromkeys(place[:2] for place in scores):
        cells = []
        for of_fish, level in product((False, True), _LEVELS[:-1]):
            off = [
                score / scores[(*place[:4], _LEVELS[-1])] - 1.0
                for place, score in scores.items()
                if place[:2] == (bed, stress) and place[4] == level and (place[2] == "fish") == of_fish
                and (*place[:4], _LEVELS[-1]) in scores
            ]  # fmt: skip
            cells.append(_percent(math.sqrt(fmean(ratio**2 for ratio in off))) if off else "")
        if any(cells):
            body.append((_PLACES[bed], stress, *cells))
    levels = (f"{animals}, {level} [%]" for animals in ("three animals", "fish") for level in _LEVELS[:-1])
    return _table(("soil", "yield stress [Pa]", *levels), body)


def foot() -> str:
    """By soil and foot: pressure and drag at three levels over those at `fine`, deepest down."""
    with (ROOT / "docs/foot.csv").open(encoding="utf-8", newline="") as file:
        rows = {tuple(row.values())[:4]: row for row in csv.DictReader(file)}  # of each place the last, deepest row
    body = []
    for bed, stress, foot in dict.fromkeys(place[:3] for place in rows):
        finest = rows[bed, stress, foot, "fine"]
        ratios = [
            f"{float(rows[bed, stress, foot, level][what]) / float(finest[what]):.2f}"
            for what, level in product(("pressure", "drag"), _LEVELS)
        ]
        body.append((f"{_PLACES[bed]} of {stress} Pa", foot, *ratios))
    return _table(("soil", "foot", *(f"{what}, {level}" for what in ("load", "drag") for level in _LEVELS)), body)


def rest_frame() -> str:
    """Scores of robots on a grid and in their rest frame by gait, and how far those that move are from the finest."""
    with (ROOT / "docs/rest-frame.csv").open(encoding="utf-8", newline="") as file:
        scores = {tuple(row.values())[:-1]: row["score"] for row in csv.DictReader(file)}
    robots, levels = ("mpm", "lagrangian"), (*_LEVELS, "fine")
    body, errors = [], defaultdict(list)
    for gait in dict.fromkeys(place[:4] for place in scores if place[3] == "100"):
        found = {pair: scores.get((*gait, *pair), "") for pair in product(robots, levels)}
        if all(found.values()):
            finest = fmean(float(found[robot, "fine"]) for robot in robots)
            for pair, score in found.items():
                errors[pair].append(float(score) / finest - 1.0)
        shown = {pair: f"{1000 * float(score):.0f}" if score else "-" for pair, score in found.items()}
        body.append((f"{gait[2]}, {_TASKS[gait[1]]} on {gait[0]}", *_ladders(shown, robots, levels)))
    rms = {pair: _percent(math.sqrt(fmean(error**2 for error in own))) for pair, own in errors.items()}
    body.append(("**moving: rms off the mean of both at `fine` [%]**", *_ladders(rms, robots, levels)))
    return _table(("gait [mm/s]", *(f"{robot}: {' / '.join(levels)}" for robot in robots)), body)


def _ladders(values: dict[tuple[str, str], str], robots: Iterable[str], levels: Iterable[str]) -> Iterator[str]:
    """The values of each robot from level to level."""
    return (" / ".join(values[robot, level] for level in levels) for robot in robots)


def speeds() -> str:
    """Moving, from the board `gaits`."""
    return _moving("gaits", ("ground", "ice", "desert", "clay", "wetland", "snow", "ocean"))


def bodies() -> str:
    """Moving in the ocean, from the boards `design` and `codesign`: a row for each design space."""
    found = {board: _cells(board) for board in ("design", "codesign")}
    columns = [(board, method) for board in found for method in dict.fromkeys(method for *_, method in found[board])]
    spaces = list(dict.fromkeys(design for cells in found.values() for _, design, _ in cells))
    return _table(
        ("space", *(f"{board}: {method} [mm/s]" for board, method in columns)),
        (
            (space, *(_speed(found[board].get(("ocean", space, method))) for board, method in columns))
            for space in spaces
        ),
    )


def policies() -> str:
    """From the board `control`: a row for each environment and task, a column for each method and controller."""
    found: dict[tuple[str, str], dict[str, dict[str, str]]] = defaultdict(dict)
    for row in _rows("leaderboards/control.csv"):
        env, task, controller, method = (
            Ref.parse(row[axis]) for axis in ("env", "task", "controller", "method")
        )  # fmt: skip
        column = f"{'policy' if controller.name == 'policy-network' else 'gait'}: {_words(method)} [mm/s]"
        found[_PLACES[env.name], _TASKS[task.name]][column] = row
    columns = list(dict.fromkeys(column for cells in found.values() for column in cells))
    return _table(
        ("place", "task", *columns),
        ((*place, *(_speed(cells.get(column)) for column in columns)) for place, cells in found.items()),
    )


def manipulation() -> str:
    """From the board of that name, in mm and mm/s: for each task and body the mean of either method, and its best
    solution, here and on the finest grid on which it was evaluated."""
    text = (ROOT / "leaderboards/manipulation.json").read_text(encoding="utf-8")
    finer = {
        (run.spec.env, run.spec.task, run.spec.design, run.spec.method): f"{_mm(run.score)} → {_mm(run.finer.score)}"
        for run in from_text(text, "manipulation").rows
        if run.finer
    }
    found: dict[tuple[Ref, ...], dict[bool, tuple[str, str]]] = defaultdict(dict)
    for row in _rows("leaderboards/manipulation.csv"):
        *cell, method = (Ref.parse(row[axis]) for axis in ("env", "task", "design", "method"))
        found[tuple(cell)][method.name == "cmaes"] = _speed(row), finer.get((*cell, method), "")
    none = ("", "")
    return _table(
        ("task", "body", "gradient, mean", "its best", "CMA-ES, mean", "its best"),
        (
            (f"`{task.name}`" + _obstacle(env), f"`{design.name}`", *methods.get(False, none), *methods.get(True, none))
            for (env, task, design), methods in found.items()
        ),
    )  # fmt: skip


def _obstacle(env: Ref) -> str:
    name = env.kwargs.get("obstacle", "none")
    return "" if name == "none" else f", {name}"


def judge() -> str:
    """Speeds of published gaits: by ever smaller finite elements, then by the simulator on ever finer grids."""
    with (ROOT / "docs/accuracy-judge.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if not row["method"].startswith("linear")]
    ways = {(row["method"], float(row["cell_mm"])): None for row in rows if row["frames"] == "100"}
    columns = sorted(ways, key=lambda way: (way[0].startswith("zoobench"), -way[1]))
    body, off = [], {way: [] for way in columns}
    for gait, frames in dict.fromkeys((row["gait"], row["frames"]) for row in rows):
        mine = [row for row in rows if (row["gait"], row["frames"]) == (gait, frames)]
        found = {(row["method"], float(row["cell_mm"])): row["score"] for row in mine}
        finest = min(way for way in found if not way[0].startswith("zoobench"))
        for way in columns if frames == "100" else ():
            if way in found and way != finest:
                off[way].append(float(found[way]) / float(found[finest]) - 1.0)
        env, _, animal = gait.split("/")
        told = (
            f"{1000 * float(found[way]):.0f}" if found.get(way, "t")[0].isdigit() else found.get(way, "")
            for way in columns
        )
        body.append((f"{animal}, {_PLACES[env]}" + (f", {frames} frames" if frames != "100" else ""), *told))
    differences = (_percent(math.sqrt(fmean(one**2 for one in off[way]))) if off[way] else "" for way in columns)
    names = (way[0].split()[1] if way[0].startswith("zoobench") else f"{way[1]:g} mm" for way in columns)
    return _table(
        ("gait [mm/s]", *names), [*body, ("rms difference from the smallest elements, 100 frames [%]", *differences)]
    )


_EARLIER = {
    ("object-slides", "way over the exact one"): ("box that slides: way over v² / 2 μ g", "1", "0.994"),
    ("object-pushed", "speed over the pusher's"): (
        "box that is pushed: speed over the pusher's", "1", "0.985 / 0.995 / 0.995",
    ),
    ("object-pushed", "way after the pusher has withdrawn"): (
        "way after the pusher has withdrawn [mm]", "0", "0.05 to 0.15",
    ),
    ("object-collision", "change of momentum"): ("collision: change of momentum", "0", "1e-06"),
    ("object-flies", "angular momentum over that at the start"): (
        "spin in flight: angular momentum over the first", "1", "0.98 to 0.997 (0.5 s)",
    ),
    ("object-carried", "acceleration of the box"): (
        "box carried on a back at 0.3 g, μ = 0.5: acceleration [g]", "0.3", "0.29 to 0.3",
    ),
    ("slip-on-back", "acceleration beyond μ g, μ = 0.5"): (
        "box that slips on a back at 1 g, μ = 0.5: acceleration beyond μ g [g]", "0", "0.34 / 0.44 / 0.31",
    ),
    ("rolling-ball", "acceleration over 5/7 g sin θ, μ = 0.5"): (
        "ball on a slope of 10°, μ = 0.5: acceleration over 5/7 g sin θ", "1",
        "0.38 (3.2 cells) / 0.60 (6.4) / 0.83 (12.8)",
    ),
}  # fmt: skip
"""Case and measure of `zoobench verify validate`: what it is, exactly, and what a prototype of objects had."""

_NEW = {
    ("object-rests", "way in a quarter of a second"): (
        "box on a slope of 10°, μ = 0.5: way in a quarter of a second [mm]", "0",
    ),
    ("object-pushed", "braking over μ g"): ("box that was pushed: braking over μ g", "1"),
    ("slip-on-back", "acceleration beyond μ g, μ = 0"): (
        "box that slips on a back at 1 g, μ = 0: acceleration [g]", "0",
    ),
    ("held-table", "deceleration"): ("box on a held obstacle, μ = 0.4: deceleration [g]", "0.4"),
    ("object-gripped", "acceleration beyond the exact one, friction of 0.5 of the weight"): (
        "box between plates, friction half of its weight: acceleration beyond 0.5 g [g]", "0",
    ),
    ("object-gripped", "acceleration beyond the exact one, friction of 1.5 of the weight"): (
        "box between plates, friction 1.5 times its weight: acceleration [g]", "0",
    ),
    ("object-sinks", "acceleration over the exact one"): (
        "ball that sinks in water on a grid: acceleration over that in ideal water", "1",
    ),
    ("held-beam", "sag over the exact one, held"): ("beam held at its end: sag over Timoshenko's", "1"),
    ("held-beam", "sag over the exact one, driven"): ("beam on a base that moves: the same", "1"),
    ("hung-beam", "sag over the exact one"): ("beam held at both ends: sag over Timoshenko's", "1"),
}  # fmt: skip
"""The same, of what the prototype did not have."""


def objects_before() -> str:
    """Closed forms of objects: exact, of the prototype, and at three grids."""
    return _closed_forms(("what happens", "exact", "prototype"), _EARLIER)


def objects_new() -> str:
    """Closed forms that the prototype was not measured by."""
    return _closed_forms(("what happens", "exact"), _NEW)


def _closed_forms(head: tuple[str, ...], shown: dict[tuple[str, str], tuple[str, ...]]) -> str:
    found: dict[tuple[str, str], dict[str, str]] = defaultdict(dict)
    for row in _rows("docs/accuracy-objects.csv"):
        parts = re.split(r",(?: box of)? (\d cells)", row["measure"])
        if len(parts) == 3:  # what is measured at another spacing is not in the table
            found[row["case"], parts[0] + parts[2]][parts[1]] = _rounded(float(row["value"]), 3)
    grids = ("4 cells", "6 cells", "8 cells")
    return _table((*head, *grids), ((*told, *(found[what][grid] for grid in grids)) for what, told in shown.items()))


def speed() -> str:
    """By environment and level: particles, control frames and particle-substeps per second."""
    rows = _rows("docs/speed.csv")
    rates = ("forward_fps", "gradient_fps", "forward_mps", "gradient_mps")
    return _table(
        ("environment", "level", "particles", "forward [frames/s]", "with gradient [frames/s]", "forward [M/s]",
         "with gradient [M/s]"),
        (
            (row["env"], row["fidelity"], row["particles"], *(_rounded(float(row[rate])) for rate in rates))
            for row in rows
        ),
    )  # fmt: skip


def _rows(name: str) -> list[dict[str, str]]:
    """The rows of a CSV file of the repository."""
    with (ROOT / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


TABLES: dict[str, Callable[[], str]] = {
    "accuracy": accuracy, "paths": paths, "turns": turns, "softness": softness, "foot": foot,
    "rest-frame": rest_frame, "judge": judge, "speeds": speeds, "bodies": bodies, "policies": policies,
    "manipulation": manipulation,
    "speed": speed, "objects-before": objects_before, "objects-new": objects_new,
}  # fmt: skip


def page(name: str) -> str:
    """A page with the tables of today."""
    text = (ROOT / name).read_text(encoding="utf-8")
    return _MARKED.sub(lambda match: f"{match[1]}{TABLES[match[2]]()}{match[3]}", text)


def _moving(board: str, envs: Iterable[str]) -> str:
    """Speeds in mm/s: of what lasts, then the mean of three seeds ± half of the 95 % interval; bold wins.

    The animals of a place come by the speed of what lasts.
    """
    cells = _cells(board)
    methods = list(dict.fromkeys(method for *_, method in cells))
    lasting = _lasting(board)
    body = []
    for env in envs:
        designs = {design for place, design, _ in cells if place == env}
        for design in sorted(designs, key=lambda design: -lasting[env, design][0]):
            found = [cells.get((env, design, method)) for method in methods]
            body.append((_PLACES[env], design, *lasting[env, design][1:], *map(_speed, found)))
    return _table(
        ("place", "animal", "fastest that lasts [mm/s]", "kept over 3x",
         *(f"{method} [mm/s]" for method in methods)), body,
    )  # fmt: skip


def _cells(board: str) -> dict[tuple[str, str, str], dict[str, str]]:
    """The cells of a board that are about moving, by environment, design and method."""
    with (ROOT / "leaderboards" / f"{board}.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if Ref.parse(row["task"]).name == "movement-speed"]
    refs = [[Ref.parse(row[axis]) for axis in ("env", "design", "method")] for row in rows]
    return {(env.name, design.name, _words(method)): row for (env, design, method), row in zip(refs, rows, strict=True)}


def _words(method: Ref) -> str:
    names = {
        "cmaes": "CMA-ES",
        "diffphysics": "gradient",
        "random": "random search",
        "neat": "NEAT",
        "evolution": "evolution",
        "ppo": "PPO",
    }
    sigma = f", sigma {method.kwargs['sigma']:g}" if method.name == "cmaes" else ""
    return names[method.name] + sigma


def _speed(row: dict[str, str] | None) -> str:
    if row is None or not row["mean"]:
        return ""
    mean = 1000 * float(row["mean"])
    half = f" ± {_rounded(1000 * (float(row['high']) - float(row['low'])) / 2)}" if row["low"] else ""
    shown = _rounded(mean, 3) + half
    return f"**{shown}**" if row["winner"] == "True" else shown


def _lasting(board: str) -> dict[tuple[str, str], tuple[float, str, str]]:
    """What the best solutions of the methods do over three times their frames, moving, by environment and design.

    The speed of the fastest that lasts, the same with its method as a text, and what the fastest over its own frames
    keeps.
    """
    text = (ROOT / "leaderboards" / f"{board}.json").read_text(encoding="utf-8")
    gaits = defaultdict(list)
    for row in from_text(text, board).rows:
        if row.spec.task.name == "movement-speed" and row.lasting:
            gaits[row.spec.env.name, row.spec.design.name].append((row.finals["score"].value, row))
    found = {}
    for place, pairs in gaits.items():
        score, best = max(pairs, key=lambda pair: pair[0])
        last = [(row.lasting.score, _words(row.spec.method)) for _, row in pairs if not row.lasting.end]
        kept = best.lasting.text(score).replace("%", " %").split(" in frame")[0]
        speed, method = max(last, default=(0.0, ""))
        found[place] = speed, f"{_rounded(1000 * speed, 3)} ({method})" if last else "none", kept
    return found


def _mm(metres: float) -> str:
    return _rounded(1000 * metres, 3)


def _table(head: Iterable[str], body: Iterable[Iterable[str]]) -> str:
    head = tuple(head)
    return "".join(f"| {' | '.join(line)} |\n" for line in (head, len(head) * ["---"], *body))


def _margins(orders: Iterable[KeptOrders]) -> str:
    orders = list(orders)
    if not any(order.pairs for order in orders):
        return "not measured"
    return _joined("?" if order.ratio is None else _percent(order.ratio - 1.0) for order in orders)


def _ratio(orders: KeptOrders) -> str:
    return "not known" if orders.ratio is None else f"{orders.ratio:.2f}"


def _known(share: float | None) -> str:
    return "?" if share is None else _percent(share)


def _percent(share: float) -> str:
    return _rounded(100 * share)


def _rounded(value: float, digits: int = 2) -> str:
    """With so many digits, without an exponent."""
    return f"{float(f'{value:.{digits}g}'):g}"


def _joined(texts: Iterable[str]) -> str:
    return " / ".join(texts)


if __name__ == "__main__":
    for each in PAGES:
        (ROOT / each).write_text(page(each), encoding="utf-8")
