"""Presets: settings that go together, from a smoke test to the published benchmark's methods on its grid."""

from collections.abc import Sequence
from dataclasses import dataclass

from zoobench.errors import UnknownNameError
from zoobench.harness.grid import GridSpec
from zoobench.spec import Budget, Ref

DEFAULT = "quick"


@dataclass(frozen=True)
class Preset:
    """The settings of runs where the user states none.

    Attributes:
        summary: its time on two cores, and its purpose.
        frames: length of an episode in control frames.
        methods: the methods with their settings; a method that the user names bare gets its settings from here.
        envs: settings of environments that the user names bare; none for those that are not here.
    """

    name: str
    summary: str
    fidelity: Ref
    frames: int
    budget: Budget
    seeds: tuple[int, ...]
    methods: tuple[Ref, ...]
    designs: tuple[Ref, ...] = (Ref("caterpillar"),)
    controllers: tuple[Ref, ...] = (Ref("sine-basis"),)
    envs: tuple[Ref, ...] = ()

    def grid(
        self,
        envs: Sequence[Ref],
        tasks: Sequence[Ref],
        *,
        designs: Sequence[Ref] | None = None,
        controllers: Sequence[Ref] | None = None,
        methods: Sequence[Ref] | None = None,
        seeds: Sequence[int] | None = None,
        budget: Budget | None = None,
        fidelity: Ref | None = None,
        frames: int | None = None,
    ) -> GridSpec:
        """The grid of these axes, with this preset's choice for each that is None."""
        return GridSpec(
            envs=tuple(_filled(env, self.envs) for env in envs),
            tasks=tuple(tasks),
            designs=self.designs if designs is None else tuple(designs),
            controllers=self.controllers if controllers is None else tuple(controllers),
            methods=self.methods if methods is None else tuple(self.with_settings(method) for method in methods),
            seeds=self.seeds if seeds is None else tuple(seeds),
            budget=budget or self.budget,
            fidelity=fidelity or self.fidelity,
            frames=self.frames if frames is None else frames,
        )

    def with_settings(self, method: Ref) -> Ref:
        """The method with this preset's settings filled in where the reference names none."""
        return _filled(method, self.methods)


def _filled(ref: Ref, settings: Sequence[Ref]) -> Ref:
    """The reference with the settings of its namesake filled in where it gives none."""
    for own in settings:
        if own.name == ref.name:
            return ref.with_defaults(**own.kwargs)
    return ref


def _published(name: str, summary: str, iterations: int, *methods: str, **axes: tuple[Ref, ...]) -> Preset:
    """A preset with the grid and episode length of the published benchmark, and with three seeds."""
    refs = tuple(map(Ref.parse, methods))
    return Preset(name, summary, Ref("paper"), 200, Budget("iterations", iterations), (0, 1, 2), refs, **axes)


# The constants of SoftZoo's code that are neither a fault nor the default here: docs/differences.md says what is left.
_SOFTZOO_TANK = "gravity=3.8,medium_density=1000,length=0.5,width=0.5"
_SOFTZOO_BED = f"{_SOFTZOO_TANK},slip=false,thickness=0.02"
_SOFTZOO_ENVS = (
    "ground[gravity=3.8]", "ice[gravity=3.8]", f"desert[{_SOFTZOO_BED}]", f"clay[{_SOFTZOO_BED},yield_stress=200]",
    f"wetland[{_SOFTZOO_BED},yield_stress=50]", f"snow[{_SOFTZOO_BED},hardening=1,critical_stretch=4.5e-3]",
    f"shallow-water[{_SOFTZOO_TANK},slip=false,depth=0.02]",
    "ocean[water=particles,gravity=3.8,length=0.5,width=0.5,youngs_modulus=1e5,muscle_strength=1.5e4]",
)  # fmt: skip

# A gradient simulates every substep three times (forward, again from a checkpoint, backward). Where the budget counts
# iterations, an iteration of `random` is therefore three times as many episodes, and both methods spend the same.
_PRESETS = (
    Preset(
        name="smoke",
        summary="seconds: every moving part moves once, the numbers mean nothing",
        fidelity=Ref("smoke"),
        frames=6,
        budget=Budget("iterations", 3),
        seeds=(0,),
        methods=(Ref.parse("diffphysics[restarts=2]"), Ref.parse("random[batch=6]")),
    ),
    Preset(
        name="quick",
        summary="minutes on two cores: a first answer",
        fidelity=Ref("draft"),
        frames=100,
        budget=Budget("substeps", 60_000),
        seeds=(0, 1),
        methods=(Ref.parse("diffphysics[restarts=1]"), Ref("random")),
    ),
    _published(
        "paper", "hours on firm ground and in the ocean, days on a bed: the published methods on the published grid",
        30, "diffphysics[lr=0.1,iterations=30,restarts=8]", "random[batch=24]",
    ),
    _published(
        "softzoo", "as paper, with gravity, beds and snow of the published code (docs/differences.md)",
        30, "diffphysics[lr=0.1,iterations=30,restarts=8]", "random[batch=24]",
        envs=tuple(map(Ref.parse, _SOFTZOO_ENVS)),
    ),
    _published(
        "animals", "as paper, for each of the four animals (SoftZoo's paper, F.1, table 1)",
        30, "diffphysics[lr=0.1,iterations=30,restarts=8]", "random[batch=24]",
        designs=(Ref("caterpillar"), Ref("baby-seal"), Ref("fish"), Ref("panda")),
    ),
    _published(
        "control", "as paper, three times as long: the controller of a given body alone (SoftZoo's paper, F.1)",
        100, "diffphysics[lr=0.01,iterations=100,restarts=8]", "random[batch=24]",
    ),
    _published(
        "design", "as paper, three times as long: a body for a given gait alone (SoftZoo's paper, F.1)",
        100, "diffphysics[lr=0.01,iterations=100,restarts=8]", "random[batch=24]",
        designs=(Ref("voxel"),), controllers=(Ref("fixed-sine"),),
    ),
    # Each method here has the iterations that it was published with, which cost unlike amounts: `zoobench table --by`
    # compares at equal ones.
    _published(
        "codesign", "as paper, eight times as long: body and controller together, also evolved (SoftZoo's paper, F.3)",
        250, "diffphysics[lr=0.01,iterations=250,restarts=8]", "evolution[sigma=0.1,population=10,generations=100]",
        "random[batch=24]", designs=(Ref("voxel"),),
    ),
    # 100 000 frames fill 49 buffers of 2048; a buffer and the evaluation after it are as long as 11 episodes.
    _published(
        "ppo", "two hours on firm ground and in the ocean: learning from 100 000 frames (SoftZoo's paper, F.2)",
        49, "ppo[timesteps=100000]", "random[batch=11]", controllers=(Ref("policy-network"),),
    ),
)  # fmt: skip


def names() -> list[str]:
    """The names of all presets, in the order in which they are listed."""
    return [preset.name for preset in _PRESETS]


def get(name: str) -> Preset:
    """The preset of that name.

    Raises:
        UnknownNameError: there is none; suggests the nearest.
    """
    for preset in _PRESETS:
        if preset.name == name:
            return preset
    raise UnknownNameError("preset", name, names())
