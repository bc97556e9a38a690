"""Measurements made up from known laws, so that the analysis can be judged."""

import numpy as np

from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.verify.accuracy.records import Balance, FidelityCost, Measurements, Sample, grid_spacing

TASK = "movement-speed"
LIMITS = np.array([0.04, -0.02, 0.01, 0.03])
SLOPES = np.array([1.0, 2.0, -1.0, 0.5])
LEVELS = ("draft", "standard", "paper", "fine")


def fidelity(text: str) -> Ref:
    """A resolved reference."""
    return registry.resolve(Kind.FIDELITY, Ref.parse(text))


def scores(text: str, draws: int = 4) -> list[float]:
    """limit + slope h, of first order in the grid spacing."""
    return list((LIMITS + SLOPES * grid_spacing(fidelity(text)))[:draws])


def sample(text: str, values: list[float], env: str = "ground", **others: object) -> Sample:
    """A run that scored many."""
    empty = np.zeros((0, 0))
    fields = {"slopes": empty, "paths": empty, "spreads": empty, "seconds_between": 0.008, "peak_memory": 2**20}
    ref = registry.resolve(Kind.ENV, Ref.parse(env))
    return Sample(env=ref, fidelity=fidelity(text), task=TASK, frames=100, scores={TASK: values}, substeps=1000.0,
                  **{**fields, **others})  # type: ignore[arg-type]  # fmt: skip


def close(text: str, offset: float, angle: float = 0.0) -> Sample:
    """A run that recorded one draw: its path off by `offset` [m] along y, its gradient turned by `angle`."""
    path = np.zeros((1, 5, 3))
    path[0, :, 0] = np.linspace(0.0, 0.04, 5)
    path[0, 1:, 1] = offset
    gradient = 2.0 * np.array([[np.cos(angle), np.sin(angle)]])
    return sample(text, [0.0], slopes=gradient, paths=path, spreads=np.ones((1, 5, 6)))


def cost(text: str, rate: float) -> FidelityCost:
    """A thousand particles at `rate` [ns]."""
    env = registry.resolve(Kind.ENV, Ref("ground"))
    return FidelityCost(env, fidelity(text), 1000, rate, 0.9 * rate, 1.2 * rate, 4 * rate, 3 * rate, 5 * rate, 1.0)


def balance(text: str, contact: float, env: str = "ground") -> Balance:
    """Muscles put in 2 J and take half a joule back; 0.4 J are stored, 0.6 lost to viscosity."""
    ref = registry.resolve(Kind.ENV, Ref.parse(env))
    return Balance(ref, fidelity(text), 2.0, 1.5, 0.4, 0.6, 0.0, contact)


def ladder(**others: Sample) -> Measurements:
    """Four levels of first order, with costs, and further samples."""
    levels = [sample(name, scores(name)) for name in LEVELS]
    costs = [cost(name, 100.0 * 2**number) for number, name in enumerate(LEVELS)]
    return Measurements((*levels, *others.values()), tuple(costs), ("made up",))
