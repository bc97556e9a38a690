"""All validation cases."""

from zoobench.verify.cases import cases_of
from zoobench.verify.validate import (
    conservation,
    elements,
    fluids,
    friction,
    gradients,
    granular,
    manufactured,
    statics,
    waves,
)

_ALL = cases_of(conservation, waves, manufactured, statics, elements, friction, granular, fluids, gradients)

CASES = tuple(sorted(_ALL, key=lambda case: -case.precision if case.precision else -48))
"""By precision, 64 bits first: each change of it restarts the runtime."""
