"""HyperNEAT (SoftZoo's paper, F.3): bodies painted by networks whose topology evolves."""

import math
import random
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.methods.base import First, RunContext, Solution, Work
from zoobench.methods.cppn import ACTIVATIONS, patterns
from zoobench.methods.generations import AskAndTell, Told, evolve, scores_of
from zoobench.registry import Kind, register

_THRESHOLD_STEP = 1.1
_HIGHEST_THRESHOLD = 1.2
"""Factor and upper bound of the compatibility threshold. Networks of a first generation are 0.8 to 1.3 apart,
of later ones 0.4 to 1 (25 populations)."""

_ALL_FAILED = -1e6
"""Fitness if a whole generation failed: below all scores, and finite, since neat-python takes means."""


@register(Kind.METHOD, "neat", version=2, tags=("evolution", "sites"))
@dataclass(frozen=True, kw_only=True)
class HyperNeat:
    """HyperNEAT (Stanley et al. 2009): pattern-producing networks of evolving topology, each of which paints a body.

    The inputs of a network are the place of a site of a design space (x, y, z, distances along the xy, xz and yz
    planes, radius), its outputs occupancy, share, stiffness and muscles there. Solid are the sites of highest
    occupancy, as many as the mean of the share over all sites tells: most functions of the networks are never negative,
    and a fixed level would make blocks of most bodies. Networks evolve by NEAT (Stanley and Miikkulainen 2002): they
    begin without hidden nodes and grow, compete within species, and genes are matched by their history. The threshold
    of compatibility follows the number of species, which is kept near the root of the population. The controller is
    drawn once and fixed: use one without parameters, or the method `evolution`.

    * `population`: individuals of a generation; SoftZoo's paper has 10.
    * `generations`: 0 for as many as the budget allows.
    """

    population: int = 10
    generations: int = 0

    def __post_init__(self) -> None:
        check_generations(self.population, self.generations)

    def work(self, frames: int) -> Work:
        """A generation."""
        return Work(frames=self.population * frames, iterations=self.generations)

    def first(self, frames: int) -> First:
        """A generation."""
        return First(self.population, frames=self.population * frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Evolve until the generations or the budget are spent.

        Raises:
            UsageError: the design is not a design space with a row of parameters for every site.
            DivergenceError, BudgetExhaustedError: as for every method.
        """
        neat = partial(_Neat, problem, context.rng, self.population)
        return evolve(problem, context, neat, population=self.population, generations=self.generations)


def check_generations(population: int, generations: int) -> None:
    """Check the settings of an evolution.

    Raises:
        UsageError: the population is less than 2, or the number of generations is negative.
    """
    if population < 2 or generations < 0:
        raise UsageError(
            f"{generations} generations of {population} are no evolution. "
            "Give a population of at least 2, and 0 or more generations."
        )


class Bodies(AskAndTell):
    """NEAT's population as an `AskAndTell` of the design space's parameters.

    Args:
        problem: with the design space.
        rng: gives the seed of NEAT's own random numbers.
        population: individuals of a generation.

    Raises:
        UsageError: the design is not a design space with a row of parameters for every site.
    """

    def __init__(self, problem: Problem, rng: np.random.Generator, population: int) -> None:
        import neat

        self._space = problem.robot.site_space
        self._places = self._space.sites(problem.body)
        self._random = _RandomStream(int(rng.integers(2**63)))
        self._config = _configuration(self._places.shape[1], 3 + problem.body.muscle_count, population)
        with self._random.active():
            self._neat = neat.Population(self._config)

    def ask(self) -> list[Array]:
        """The next generation, `[parameter_count]` each of the design space."""
        genomes = self._neat.population.values()
        return [self._space.painted(patterns(genome, self._config, self._places)) for genome in genomes]

    def digest(self, evaluations: Sequence[Evaluation]) -> Told:
        """Fitness: the scores; a failed episode is as far below the worst score as the best is above it."""
        scores = scores_of(evaluations)
        able = [score for score in scores if score is not None]
        failed = min(able) - ((max(able) - min(able)) or 1.0) if able else _ALL_FAILED
        return [failed if score is None else score for score in scores]

    def tell(self, told: Told) -> None:
        """Select and reproduce by fitness."""
        neat = self._neat
        for genome, fitness in zip(neat.population.values(), told, strict=True):
            genome.fitness = fitness
        with self._random.active():
            neat.population = neat.reproduction.reproduce(
                self._config, neat.species, self._config.pop_size, neat.generation
            )
            neat.species.speciate(self._config, neat.population, neat.generation)
        neat.generation += 1
        self._adapt_threshold()

    def _adapt_threshold(self) -> None:
        """Move the compatibility threshold towards as many species as the root of the population.

        neat-python never merges species, so that a threshold above the distance of unrelated networks has no effect.
        """
        species, wanted = len(self._neat.species.species), round(math.sqrt(self._config.pop_size))
        found = self._config.species_set_config
        if species < wanted:
            found.compatibility_threshold /= _THRESHOLD_STEP
        elif species > wanted:
            found.compatibility_threshold = min(found.compatibility_threshold * _THRESHOLD_STEP, _HIGHEST_THRESHOLD)

    def readings(self) -> dict[str, float]:
        """Number of species, and mean numbers of nodes and enabled connections of a network."""
        sizes = np.array([genome.size() for genome in self._neat.population.values()])
        nodes, connections = sizes.mean(axis=0)
        return {
            "species": float(len(self._neat.species.species)),
            "nodes": float(nodes),
            "connections": float(connections),
        }


class _Neat(Bodies):
    """The bodies with one controller, drawn once."""

    def __init__(self, problem: Problem, rng: np.random.Generator, population: int) -> None:
        super().__init__(problem, rng, population)
        self._control = problem.initial(rng)[: problem.robot.control_count]

    def ask(self) -> list[Array]:
        """The next generation, `[parameter_count]` each."""
        return [np.concatenate([self._control, body]) for body in super().ask()]


class _RandomStream:
    """A stream of random numbers in place of Python's global generator, from which neat-python draws."""

    def __init__(self, seed: int) -> None:
        self._state = random.Random(seed).getstate()

    @contextmanager
    def active(self) -> Iterator[None]:
        """Draw from this stream within the context; the global generator's state is restored after it."""
        before = random.getstate()
        random.setstate(self._state)
        try:
            yield
        finally:
            self._state = random.getstate()
            random.setstate(before)


def _configuration(inputs: int, outputs: int, population: int) -> Any:
    """neat-python's configuration, which it reads from files only."""
    import neat

    parts = (neat.DefaultGenome, neat.DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "neat.ini"
        options = " ".join(ACTIVATIONS)
        text = _SETTINGS.format(inputs=inputs, outputs=outputs, population=population, activations=options)
        path.write_text(text, encoding="utf-8")
        config = neat.Config(*parts, str(path))
    for name, function in ACTIVATIONS.items():
        config.genome_config.add_activation(name, function)
    return config


_SETTINGS = """
[NEAT]
pop_size = {population}
fitness_criterion = max
fitness_threshold = 0
no_fitness_termination = True
reset_on_extinction = False

[DefaultGenome]
num_inputs = {inputs}
num_hidden = 0
num_outputs = {outputs}
feed_forward = True
initial_connection = full_direct
compatibility_disjoint_coefficient = 1.0
compatibility_weight_coefficient = 0.5
conn_add_prob = 0.3
conn_delete_prob = 0.2
node_add_prob = 0.2
node_delete_prob = 0.1
single_structural_mutation = False
structural_mutation_surer = default
activation_default = random
activation_options = {activations}
activation_mutate_rate = 0.1
aggregation_default = sum
aggregation_options = sum
aggregation_mutate_rate = 0.0
bias_init_mean = 0.0
bias_init_stdev = 0.5
bias_init_type = gaussian
bias_max_value = 10.0
bias_min_value = -10.0
bias_mutate_power = 0.3
bias_mutate_rate = 0.5
bias_replace_rate = 0.05
response_init_mean = 1.0
response_init_stdev = 0.0
response_init_type = gaussian
response_max_value = 1.0
response_min_value = 1.0
response_mutate_power = 0.0
response_mutate_rate = 0.0
response_replace_rate = 0.0
time_constant_init_mean = 1.0
time_constant_init_stdev = 0.0
time_constant_init_type = gaussian
time_constant_max_value = 1.0
time_constant_min_value = 1.0
time_constant_mutate_power = 0.0
time_constant_mutate_rate = 0.0
time_constant_replace_rate = 0.0
weight_init_mean = 0.0
weight_init_stdev = 0.5
weight_init_type = gaussian
weight_max_value = 10.0
weight_min_value = -10.0
weight_mutate_power = 0.3
weight_mutate_rate = 0.5
weight_replace_rate = 0.05
enabled_default = True
enabled_mutate_rate = 0.02
enabled_rate_to_true_add = 0.0
enabled_rate_to_false_add = 0.0

[DefaultSpeciesSet]
compatibility_threshold = 1.0

[DefaultStagnation]
species_fitness_func = max
max_stagnation = 15
species_elitism = 2

[DefaultReproduction]
elitism = 1
survival_threshold = 0.3
min_species_size = 1
"""
