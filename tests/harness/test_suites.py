"""Suites: a file becomes runs in order of value, or a refusal that names file, key and what was expected."""

import math
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from zoobench.accuracy.rates import rate
from zoobench.cell.robot import Robot
from zoobench.db import published
from zoobench.errors import UnknownNameError, UsageError
from zoobench.harness import suites
from zoobench.harness.grid import Skip
from zoobench.harness.suites import Suite, read
from zoobench.inputs import named_runs
from zoobench.report.estimate import Estimator
from zoobench.spec import RunSpec

COMPLETE = """
summary: a test
grids:
  - envs: ground
    tasks: turning
    designs: caterpillar
    controllers: sine-basis
    methods: random
    seeds: 1
    budget: 100 substeps
    fidelity: draft
    frames: 10
"""


def suite_of(content: str) -> Suite:
    """The suite of a file called mine.yaml."""
    return read(content, "mine.yaml", source="mine.yaml")


@cache
def loaded(name: str) -> Suite:
    """A shipped suite; to read one takes up to seconds."""
    return suites.load(name)


@pytest.mark.parametrize("name", suites.names())
def test_every_suite_can_be_carried_out(name: str) -> None:
    """Each run once, none that its method cannot do, and a summary to choose by."""
    suite = loaded(name)
    assert not [cell for cell in suite.cells if isinstance(cell, Skip)]
    assert len({spec.key() for spec in suite.specs}) == len(suite.specs) > 0
    assert suite.name == suite.source == name
    assert suites.summaries(name)[name] == suite.summary


@pytest.mark.parametrize("name", suites.names())
def test_only_the_suite_of_that_name_is_for_smoke(name: str) -> None:
    """The others give results that may be shown."""
    assert {spec.fidelity.name == "smoke" for spec in loaded(name).specs} == {name == "smoke"}


@pytest.mark.parametrize("name", ["gaits", "shallows", "design", "codesign", "control", "manipulation"])
def test_methods_compete_at_equal_substeps(name: str) -> None:
    """All runs of a row have the same budget, counted in substeps, and the same three seeds."""
    rows: dict[tuple[object, ...], set[object]] = {}
    for spec in loaded(name).specs:
        rows.setdefault((spec.env, spec.task, spec.design, spec.controller), set()).add(spec.budget)
        assert spec.budget.kind == "substeps"
        assert spec.seed in range(3)
    assert {len(budgets) for budgets in rows.values()} == {1}


def test_skills_are_shown_and_not_compared() -> None:
    """One run of the gradient for each task."""
    specs = loaded("skills").specs
    assert {(spec.method.name, spec.seed, spec.budget.kind) for spec in specs} == {("diffphysics", 0, "substeps")}
    assert len({(spec.env, spec.task) for spec in specs}) == len(specs)


@pytest.mark.parametrize("name", ["gaits", "shallows", "design", "codesign", "control", "paper"])
def test_the_boards_have_the_published_episode(name: str) -> None:
    """200 frames, 1.6 s, so that a gait has to last."""
    assert {spec.frames for spec in loaded(name).specs} == {200}


def test_gaits_has_speeds_first_and_turning_second() -> None:
    """7 places, 3 methods and 3 seeds, of four animals; of one the specification's CMA-ES, too, and paths."""
    specs = loaded("gaits").specs
    tasks = [spec.task.name for spec in specs]
    paths = ["waypoint-following", "velocity-tracking"]
    assert tasks[: 273 + 252] == ["movement-speed"] * 273 + ["turning"] * 252
    assert Counter(tasks[273 + 252 :]) == dict.fromkeys(paths, 63)
    sigmas = Counter(spec.method.kwargs["sigma"] for spec in specs if spec.method.name == "cmaes")
    assert sigmas == {0.3: 70 * 3, 0.1: 7 * 3}
    assert len({(spec.env, spec.task, spec.design) for spec in specs}) == 70


def test_design_and_codesign_have_all_six_spaces_under_gradient_and_floor() -> None:
    """Evolution only where it can be; the gait is a trained swimmer's in one and found in the other."""
    for name, rival, controller in (("design", "neat", "stored"), ("codesign", "evolution", "sine-basis")):
        specs = loaded(name).specs
        spaces = Counter(spec.method.name for spec in specs if spec.seed == 0)
        assert spaces == {"diffphysics": 6, "random": 6, rival: 2}
        assert {spec.controller.name for spec in specs} == {controller}
        assert {(spec.env.name, spec.task.name) for spec in specs} == {("ocean", "movement-speed")}


def test_design_has_the_geometry_alone_to_find() -> None:
    """Of bodies with the muscles of a swimmer, which the gait of a trained one drives, found without a database."""
    specs = loaded("design").specs
    assert {spec.design.kwargs["optimise"] for spec in specs} == {"geometry"}
    robots = {spec.design: Robot.of_run(spec) for spec in specs}
    assert {robot.control_count for robot in robots.values()} == {0}
    assert {robot.body.muscle_count for robot in robots.values()} == {8}
    (key,) = {key for spec in specs for key in named_runs(spec.controller)}
    trained = published.with_key(key)
    assert trained is not None
    assert (trained.spec.env.name, trained.spec.controller.name) == ("ocean", "sine-basis")
    assert trained.spec.method.name == "diffphysics"


def test_control_has_policies_beside_gaits() -> None:
    """Reinforcement learning only where there is a policy, and the gradient in both."""
    pairs = Counter((spec.controller.name, spec.method.name) for spec in loaded("control").specs)
    assert pairs == {
        ("policy-network", "ppo"): 6,
        ("policy-network", "diffphysics"): 6,
        ("policy-network", "random"): 6,
        ("sine-basis", "diffphysics"): 6,
        ("sine-basis", "random"): 6,
    }


def test_paper_has_the_settings_of_the_appendix() -> None:
    """F.1: rate and iterations by what is optimised, with 8 starts; F.2; F.3."""
    found = {(spec.controller.name, spec.design.name, spec.method.name, spec.method.params) for spec in _paper()}
    ascents = {
        (controller, design): (dict(params)["lr"], dict(params)["iterations"], dict(params)["restarts"])
        for controller, design, method, params in found
        if method == "diffphysics" and design != "caterpillar"
    }
    assert ascents["sine-basis", "panda"] == (0.1, 30, 8)
    assert ascents["fixed-sine", "implicit"] == (0.01, 100, 8)
    assert ascents["sine-basis", "barycenter"] == (0.01, 250, 8)
    ppo = next(dict(params) for _, _, method, params in found if method == "ppo")
    wanted = {"timesteps": 100_000, "buffer": 2048, "batch": 32, "gae": 0.95, "discount": 0.98, "epochs": 20}
    wanted |= {"entropy": 0.001, "lr": 1e-4, "clip": 0.2}
    assert {name: ppo[name] for name in wanted} == wanted
    evolution = next(dict(params) for _, _, method, params in found if method == "evolution")
    assert evolution == {"population": 10, "generations": 100, "sigma": 0.1}


@pytest.mark.slow
def test_paper_has_policies_for_every_animal_and_evolution_in_every_space() -> None:
    """As the published benchmark has: a row for each, in parts that can be run alone."""
    learners = {(spec.env, spec.task, spec.design) for spec in _paper() if spec.method.name == "ppo"}
    assert learners == {(spec.env, spec.task, spec.design) for spec in loaded("paper/animals").specs}
    assert len(learners) == 8 * 4 * 4
    for part in ("design", "codesign"):
        specs = loaded(f"paper/{part}").specs
        evolved = {spec.design.name for spec in specs if spec.method.name in ("neat", "evolution", "cmaes")}
        assert evolved == {spec.design.name for spec in specs if spec.method.name == "diffphysics"}
        assert len(evolved) == 6


def test_the_parts_of_paper_cost_what_their_lines_say() -> None:
    """Core-days by the measured rates, within a tenth: who reads the list knows before anything is queued."""
    estimator = Estimator([], rate)
    lines = suites.summaries("paper")
    suite = loaded("paper")
    keys = {"paper": set().union(*suite.parts.values())} | {f"paper/{name}": own for name, own in suite.parts.items()}
    assert keys.keys() == lines.keys()
    costs = {spec.key(): found.seconds / 86400 for spec in suite.specs if (found := estimator(spec))}
    for name, own in keys.items():
        stated = float(lines[name].partition(" core-days")[0].replace(",", ""))
        assert sum(costs[key] for key in own) == pytest.approx(stated, rel=0.1), name
    assert len(costs) == len(suite.specs)


def test_a_part_is_a_suite_of_its_own(tmp_path: Path) -> None:
    """Of a suite of the package and of a file; a leaderboard of it has a name that is a file's."""
    grids = COMPLETE.replace("grids:\n  - envs", "parts: {mine: one, yours: two}\ngrids:\n  - part: mine\n    envs")
    path = tmp_path / "mine.yaml"
    path.write_text(grids + grids[grids.index("  - part") :].replace("mine", "yours").replace("ground", "ice"))
    whole, part = suites.load(str(path)), suites.load(f"{path}/yours")
    assert (part.name, part.source) == ("mine-yours", "mine.yaml/yours")
    assert [spec.env.name for spec in whole.specs] == ["ground", "ice"]
    assert [spec.env.name for spec in part.specs] == ["ice"]
    with pytest.raises(UnknownNameError, match="Did you mean 'yours'"):
        suites.load(f"{path}/your")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("grids:", "parts: {mine: one}\ngrids:", "grid 1, part: None, expected one that `parts` explains: mine"),
        ("    seeds", "    part: mine\n    seeds", "grid 1, part: 'mine', expected .*: no part at all"),
        ("grids:", "parts: [mine]\ngrids:", "parts: .*expected the purpose of each part"),
        ("grids:\n  - envs", "parts: {a: x, b: y}\ngrids:\n  - part: a\n    envs", "no grid belongs to 'b'"),
    ],
)
def test_parts_and_grids_must_agree(old: str, new: str, message: str) -> None:
    """File, grid and what was expected are named."""
    with pytest.raises(UsageError, match=message):
        suite_of(COMPLETE.replace(old, new))


def _paper() -> tuple[RunSpec, ...]:
    return loaded("paper").specs


@pytest.mark.slow
def test_a_run_of_gaits_is_some_thirty_iterations() -> None:
    """By the declared step of every environment and animal; a gradient costs three episodes. Fewer where it is dear."""
    from zoobench.cell.problem import Problem

    cells = {(spec.env, spec.design): spec for spec in loaded("gaits").specs}
    counts = {
        (env.name, design.name): math.floor(spec.budget.amount / Problem(spec).substeps_per_episode / 3)
        for (env, design), spec in cells.items()
    }
    assert len(counts) == 28
    least = {"ocean": 15, "snow": 12}
    assert all(least.get(env, 28) <= count <= 1.4 * least.get(env, 28) for (env, _), count in counts.items())


def test_common_settings_are_those_of_grids_that_state_none() -> None:
    """A grid's own come before; the grids' order is that of the runs, and none comes twice."""
    grid, settings = COMPLETE.split("grids:")
    common = settings.replace("  - envs", "  envs").replace("    ", "  ")
    suite = suite_of(f"{grid}common:{common}grids:\n  - envs: [ice, desert]\n  - {{}}\n  - envs: '*'\n    seeds: [4]\n")
    assert [(spec.env.name, spec.seed) for spec in suite.specs[:3]] == [("ice", 0), ("desert", 0), ("ground", 0)]
    assert {spec.seed for spec in suite.specs[3:]} == {4}
    assert len(suite.specs) == 3 + 8


def test_a_budget_may_depend_on_the_environment() -> None:
    """The first name or pattern that fits counts."""
    content = COMPLETE.replace("envs: ground", "envs: [snow, ground, ice]")
    content = content.replace("100 substeps", '{snow: 500, "i*": 2 episodes, "*": 250}')
    budgets = {spec.env.name: str(spec.budget) for spec in suite_of(content).specs}
    assert budgets == {"snow": "500 substeps", "ground": "250 substeps", "ice": "2 episodes"}


def test_a_fidelity_may_depend_on_the_environment() -> None:
    """The first name or pattern that fits counts, and what fits none of them is read, too."""
    content = COMPLETE.replace("envs: ground", "envs: [snow, ground, ice]")
    levels = 'fidelity: {"i*": "draft[courant=0.5]", ground: standard, "*": paper}'
    specs = suite_of(content.replace("fidelity: draft", levels)).specs
    found = {spec.env.name: (spec.fidelity.name, spec.fidelity.kwargs["courant"]) for spec in specs}
    assert found == {"snow": ("paper", 0.7), "ground": ("standard", 0.7), "ice": ("draft", 0.5)}


@pytest.mark.parametrize("selector", ["ground-v4", '"ground[friction=0.5]"', '"g*[friction=0.5]"'])
def test_a_mapping_sees_the_version_and_the_defaults_of_an_environment(selector: str) -> None:
    """Though the grid names it without; the other environment has another friction."""
    content = COMPLETE.replace("envs: ground", "envs: [ground, ice]")
    found = suite_of(content.replace("fidelity: draft", f"fidelity: {{{selector}: standard, '*': paper}}")).specs
    assert {spec.env.name: spec.fidelity.name for spec in found} == {"ground": "standard", "ice": "paper"}


def test_what_cannot_be_done_is_a_skip_with_its_reason() -> None:
    """As in a grid of the command line."""
    (cell,) = suite_of(COMPLETE.replace("methods: random", "methods: neat")).cells
    assert isinstance(cell, Skip)
    assert "needs a design space" in cell.reason


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("frames: 10", "frame: 10", r"Unknown key in mine.yaml, grid 1: 'frame'. Did you mean 'frames'"),
        ("frames: 10", "", r"mine.yaml, grid 1, frames: nothing, expected a value here or in `common`"),
        ("frames: 10", "frames: 1.5", r"grid 1, frames: 1.5, expected a whole number"),
        ("frames: 10", "frames: true", r"grid 1, frames: True, expected a whole number"),
        ("seeds: 1", "seeds: 0", r"grid 1, seeds: 0, expected how many seeds"),
        ("seeds: 1", "seeds: [0, -1]", r"grid 1, seeds: \[0, -1\], expected how many seeds"),
        ("seeds: 1", "seeds: 10001", r"at most 10,000"),
        ("envs: ground", "envs: grund", r"grid 1, envs: Unknown environment 'grund'. Did you mean 'ground'"),
        (
            "controllers: sine-basis",
            "controllers: 'stored[run=best:ocean/movement-speed/fsh]'",
            r"grid 1, controllers: Unknown solution.*Did you mean 'best:ocean/movement-speed/fish'",
        ),
        ("envs: ground", "envs: 3", r"grid 1, envs: 3, expected a name as `zoobench list envs` shows them, or a list"),
        ("envs: ground", "envs: []", r"grid 1, envs: \[\], expected"),
        ("methods: random", 'methods: "random[batsch=2]"', r"grid 1: .*batsch"),
        ("methods: random", 'methods: "random[batch=0]"', r"grid 1: .*batch"),
        ("budget: 100 substeps", "budget: 100 apples", r"grid 1, budget: Unknown budget kind 'apples'"),
        ("budget: 100 substeps", "budget: [1]", r"grid 1, budget: \[1\], expected a budget such as"),
        (
            "budget: 100 substeps",
            "budget: {snow: 1}",
            r"grid 1, budget: nothing for ground, expected a value for each",
        ),
        ("fidelity: draft", "fidelity: [draft]", r"grid 1, fidelity: \['draft'\], expected the name of a fidelity"),
        (
            "fidelity: draft",
            "fidelity: {snow: draft}",
            r"grid 1, fidelity: nothing for ground, expected a value for each",
        ),
        ("fidelity: draft", "fidelity: {ground: draft, ice: darft}", r"grid 1, fidelity: .*Did you mean 'draft'"),
        ("fidelity: draft", "fidelity: '*'", r"grid 1, fidelity: .* means several"),
        (
            "fidelity: draft",
            "fidelity: {grund: paper, '*': draft}",
            r"grid 1, fidelity: Unknown environment 'grund'. Did you mean 'ground'",
        ),
        (
            "budget: 100 substeps",
            "budget: {ground-v99: 9, '*': 100}",
            r"grid 1, budget: The environment 'ground' has no version 99",
        ),
        (
            "budget: 100 substeps",
            "budget: {'ground[frction=1]': 9, '*': 100}",
            r"grid 1, budget: Unknown parameter of 'ground': 'frction'",
        ),
        ("summary: a test", "summary: 3", r"mine.yaml, summary: 3, expected a line of text"),
        ("summary: a test", "", r"mine.yaml, summary: nothing"),
        ("summary: a test", "summary: a\nsummary: b", r"Cannot read mine.yaml as YAML: the key 'summary' comes twice"),
        ("summary: a test", "summary: a\ncomon: {}", r"Unknown key in mine.yaml: 'comon'. Did you mean 'common'"),
        ("summary: a test", "summary: a\ncommon: []", r"mine.yaml, common: \[\], expected keys with values"),
        ("summary: a test", "summary: [", r"Cannot read mine.yaml as YAML"),
        ("frames: 10", f"frames: {'9' * 5000}", r"a number of 5,000 characters, expected at most 100"),
        ("frames: 10", f"frames: 0x{'f' * 5000}", r"a number of 5,002 characters"),
        ("frames: 10", f"frames: 1{':59' * 3000}", r"a number of 9,001 characters"),
        ("frames: 10", f"frames: {'9' * 99}", r"mine.yaml, grid 1"),
    ],
)
def test_what_no_suite_says_is_refused_with_its_place(old: str, new: str, message: str) -> None:
    """File, grid, key, what was given and what was expected."""
    assert old in COMPLETE
    with pytest.raises(UsageError, match=message):
        suite_of(COMPLETE.replace(old, new))


@pytest.mark.parametrize("content", ["", "3", "- a", "summary: a", "summary: a\ngrids: []", "summary: a\ngrids: [3]"])
def test_a_file_without_grids_is_refused(content: str) -> None:
    """Nothing, a number, a list, no grids, none in the list, or something else."""
    with pytest.raises(UsageError, match=r"mine.yaml.*expected"):
        suite_of(content)


def test_code_in_a_file_is_not_carried_out() -> None:
    """A tag that would call Python is not understood."""
    with pytest.raises(UsageError, match=r"Cannot read mine\.yaml as YAML"):
        suite_of("summary: !!python/object/apply:os.getcwd []")


def test_a_suite_is_named_or_in_a_file(tmp_path: Path) -> None:
    """What ends in .yaml is a path; of it only the file's name is kept."""
    path = tmp_path / "mine.yaml"
    path.write_text(COMPLETE)
    suite = suites.load(str(path))
    assert (suite.name, suite.source, len(suite.specs)) == ("mine", "mine.yaml", 1)
    with pytest.raises(UnknownNameError, match=r"Unknown suite 'gates'\. Did you mean 'gaits'"):
        suites.load("gates")
    with pytest.raises(UsageError, match="Cannot read the suite"):
        suites.load(str(tmp_path / "other.yaml"))
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(UsageError, match="Cannot read the suite"):
        suites.load(str(path))


_EVERYTHING = """
summary: everything
grids:
  - {envs: "*", tasks: "*", designs: "*", controllers: "*", methods: "*", seeds: 10000, budget: 10, fidelity: draft,
     frames: 10}
"""
_LAUGHS = "".join(f"a{i}: &a{i} [" + ", ".join([f"*a{i - 1}"] * 10) + "]\n" for i in range(1, 9))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        pytest.param("summary: " + "[" * 5000, "nested too deep", marks=pytest.mark.slow),
        (COMPLETE.replace("budget: 100 substeps", "budget: 2001-99-99"), "Cannot read '2001-99-99' as a budget"),
        (COMPLETE.replace("budget: 100 substeps", "budget: 2001-01-01"), "Cannot read '2001-01-01' as a budget"),
        (COMPLETE.replace("budget: 100 substeps", "budget: !!timestamp 2001-99-99"), "month must be in"),
        ("a0: &a0 x\n" + _LAUGHS + "summary: x\ngrids: *a8", r"expected keys with values"),
        ("summary: x\ngrids: [{envs: " + "[" * 30 + "]" * 30 + "}]", r"envs: \[\[\["),
        (_EVERYTHING, "The grid has [0-9,]+ runs, and 200,000 are the most"),
    ],
    ids=["deep", "no-date", "date", "timestamp", "aliases", "nested", "everything"],
)
def test_a_file_that_asks_too_much_is_refused(content: str, message: str) -> None:
    """In words, before time or memory is spent on it."""
    with pytest.raises(UsageError, match=message) as error:
        suite_of(content)
    assert len(str(error.value)) < 1000
