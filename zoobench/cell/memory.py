"""How much memory this process took."""

import sys


def peak_memory() -> int | None:
    """The largest resident memory of this process so far [bytes]; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
