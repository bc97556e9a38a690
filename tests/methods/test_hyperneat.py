"""HyperNEAT: networks are those of neat-python, known bodies are found, and global random numbers are unchanged."""

import random

import neat
import numpy as np
import pytest
import torch
from neat.activations import ActivationFunctionSet

from tests.methods.toy import Context, Quadratic
from tests.methods.toy_bodies import NOW, Sculpture, robot_of
from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.errors import UsageError
from zoobench.methods.cppn import ACTIVATIONS, patterns
from zoobench.methods.hyperneat import Bodies, HyperNeat
from zoobench.spec import Budget


@pytest.mark.slow  # tests/methods/test_known_answers.py finds the same body, to 95 %
def test_it_finds_a_body_that_is_known() -> None:
    """The front half of a block, to 98 % of the particles."""
    solution = HyperNeat().run(Sculpture(Budget("episodes", 600)), Context(0))  # type: ignore[arg-type]
    assert solution.evaluation.score >= 0.98
    assert solution.params.shape == (Sculpture(Budget("episodes", 1)).parameter_count,)


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_an_activation_is_that_of_neat_python(name: str) -> None:
    """Value by value, in the steep and in the clipped range."""
    theirs = ActivationFunctionSet().get({"gaussian": "gauss"}.get(name, name))
    drives = np.linspace(-11.0, 11.0, 223)
    np.testing.assert_allclose(ACTIVATIONS[name](drives), [theirs(drive) for drive in drives], rtol=1e-12, atol=1e-15)


def test_a_pattern_is_the_networks_output_at_every_place() -> None:
    """Networks after twenty generations, against neat-python one place at a time."""
    problem = Quadratic(Budget("episodes", 1))
    bodies = Bodies(problem, np.random.default_rng(0), 10)  # type: ignore[arg-type]
    fitness = np.random.default_rng(1)
    for _ in range(20):
        bodies.tell(fitness.normal(size=10).tolist())
    places = np.random.default_rng(2).uniform(-1.0, 1.0, (5, 7))
    genomes = list(bodies._neat.population.values())
    ours = [patterns(genome, bodies._config, places) for genome in genomes]
    assert max(len(genome.nodes) for genome in genomes) > 4
    for name in ACTIVATIONS:
        scalar = ActivationFunctionSet().get({"gaussian": "gauss"}.get(name, name))
        bodies._config.genome_config.add_activation(name, scalar)
    for genome, found in zip(genomes, ours, strict=True):
        network = neat.nn.FeedForwardNetwork.create(genome, bodies._config)
        np.testing.assert_allclose(found, [network.activate(place) for place in places], rtol=1e-9, atol=1e-12)


def test_pythons_random_numbers_are_neither_used_nor_disturbed() -> None:
    """The state of the global generator has no influence and is restored."""
    found = []
    for seed in (1, 2):
        random.seed(seed)
        before = random.getstate()
        problem = Quadratic(Budget("iterations", 5))
        HyperNeat().run(problem, Context(3))  # type: ignore[arg-type]
        assert random.getstate() == before
        found.append(np.array(problem.seen))
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("seed", range(4))
def test_the_population_survives_all_scores(seed: int) -> None:
    """With equal, extreme or failed scores it stays complete and finite."""
    rng = np.random.default_rng(seed)
    bodies = Bodies(Quadratic(Budget("episodes", 1)), rng, 10)  # type: ignore[arg-type]
    for generation in range(60):
        scores = rng.normal(size=10) * 10.0 ** rng.integers(-9, 9)
        scores[rng.random(10) < (generation % 4) / 3] = -np.inf
        scores = np.zeros(10) if generation % 7 == 3 else scores
        points = bodies.ask()
        assert len(points) == 10
        assert np.isfinite(points).all()
        bodies.tell(bodies.digest([Evaluation(score, {}, np.zeros(0)) for score in scores.tolist()]))


def test_what_failed_is_less_fit_than_all_others() -> None:
    """As far below the worst as the best is above it, in any unit of the score."""
    bodies = Bodies(Quadratic(Budget("episodes", 1)), np.random.default_rng(0), 10)  # type: ignore[arg-type]

    def told(*scores: float) -> object:
        return bodies.digest([Evaluation(score, {}, np.zeros(0)) for score in scores])

    assert told(3.0, -np.inf, 1.0) == [3.0, -1.0, 1.0]
    assert told(np.nan, 2.0) == [1.0, 2.0]
    assert told(-np.inf, -np.inf) == [-1e6, -1e6]


@pytest.mark.parametrize("design", ["voxel", "particle[base=caterpillar]"])
def test_first_bodies_mostly_hold_together(design: str) -> None:
    """Four of five can be built in one piece, and their sizes differ."""
    problem = Sculpture(Budget("episodes", 1))
    problem.robot = robot_of(design)  # type: ignore[assignment]
    problem.body = problem.robot.body
    points = [point for seed in range(5) for point in Bodies(problem, np.random.default_rng(seed), 10).ask()]  # type: ignore[arg-type]
    drafts = [problem.robot.draft(torch.as_tensor(point)[None], NOW) for point in points]  # type: ignore[attr-defined]
    built = [draft.solid().metrics for draft in drafts if not draft.fault]
    whole = [metrics for metrics in built if metrics["components"].value == 1.0]
    assert len(whole) >= 0.8 * len(drafts)
    shares = np.array([metrics["body_volume"].value for metrics in whole]) / problem.body.volumes.sum()
    assert np.ptp(shares) > 0.3


def shares_of(points: list[Array], problem: Sculpture) -> Array:
    """The share of the workspace that is built of each body `[count]`; 0 if it cannot be built."""
    drafts = [problem.robot.draft(torch.as_tensor(point)[None], NOW) for point in points]  # type: ignore[attr-defined]
    solid = [0.0 if draft.fault else draft.solid().metrics["body_volume"].value for draft in drafts]
    return np.array(solid) / problem.body.volumes.sum()


@pytest.fixture(scope="module")
def lines() -> list[tuple[Array, Array, Array]]:
    """Shares of the first and of the last of 30 generations, and numbers of species, of 10 populations under chance."""
    problem, found = Sculpture(Budget("episodes", 1)), []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        bodies, species = Bodies(problem, rng, 10), []  # type: ignore[arg-type]
        first = shares_of(bodies.ask(), problem)
        for _ in range(30):
            bodies.tell(rng.normal(size=10).tolist())
            species.append(bodies.readings()["species"])
        found.append((first, shares_of(bodies.ask(), problem), np.array(species)))
    return found


@pytest.mark.slow
def test_bodies_are_no_blocks(lines: list[tuple[Array, Array, Array]]) -> None:
    """Few are full or empty in the first generation, and half are neither after many; they are of all sizes."""
    for place, least in ((0, 0.8), (1, 0.5)):
        shares = np.concatenate([line[place] for line in lines])
        between = shares[(shares > 0.001) & (shares < 0.999)]
        assert len(between) >= least * len(shares)
        assert np.quantile(between, 0.25) < 0.5
        assert np.quantile(between, 0.1) < 0.3 < 0.9 < np.quantile(between, 0.9)


@pytest.mark.slow
def test_species_live_beside_each_other(lines: list[tuple[Array, Array, Array]]) -> None:
    """Three or more in most generations, and never as many as would leave each its champion alone."""
    species = np.concatenate([line[2] for line in lines])
    assert (species >= 3).mean() > 0.6
    assert species.max() < 8


@pytest.mark.parametrize("design", ["caterpillar", "implicit"])
def test_a_design_without_sites_is_refused(design: str) -> None:
    """The message names the designs with sites."""
    problem = Quadratic(Budget("iterations", 2))
    problem.robot = robot_of(design)  # type: ignore[assignment]
    with pytest.raises(UsageError, match="--design particle or --design voxel"):
        HyperNeat().run(problem, Context())  # type: ignore[arg-type]


def test_it_makes_the_generations_asked_for() -> None:
    """`generations` ends the run before the budget does."""
    problem, context = Quadratic(Budget("episodes", 1000)), Context()
    HyperNeat(population=6, generations=4).run(problem, context)  # type: ignore[arg-type]
    assert (problem.meter.iterations, len(problem.seen)) == (4, 24)
    assert context.fractions[-1] == 1.0
