"""All validation cases."""

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

_ALL = (
    *conservation.CASES,
    *waves.CASES,
    *manufactured.CASES,
    *statics.CASES,
    *elements.CASES,
    *friction.CASES,
    *granular.CASES,
    *fluids.CASES,
    *gradients.CASES,
)

CASES = tuple(sorted(_ALL, key=lambda case: -case.precision if case.precision else -48))
"""By precision, 64 bits first: each change of it restarts the runtime."""
