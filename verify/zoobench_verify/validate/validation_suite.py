"""All validation cases."""

from zoobench_verify.cases import cases_of
from zoobench_verify.validate import (
    conservation,
    elements,
    fluids,
    footings,
    friction,
    gradients,
    granular,
    hertz,
    imposed_waves,
    interface,
    manufactured,
    modes,
    mud,
    muscle_pulls,
    object_contacts,
    object_motions,
    rest_frame_contacts,
    rest_frame_statics,
    statics,
    surface_energy,
    surface_forces,
    surface_motions,
    swimmers,
    swimming,
    waves,
)

_ALL = cases_of(
    conservation, waves, manufactured, statics, modes, muscle_pulls, hertz, elements, friction, object_contacts,
    object_motions, footings, interface, granular, mud, fluids, swimming, swimmers,
    surface_forces, surface_motions, imposed_waves, surface_energy, gradients,
    rest_frame_statics, rest_frame_contacts,
)  # fmt: skip

CASES = tuple(sorted(_ALL, key=lambda case: -case.precision if case.precision else -48))
"""By precision, 64 bits first: each change of it restarts the runtime."""
