"""Memory use of this process."""

import sys


def peak_memory() -> int | None:
    """Peak resident memory of this process [bytes]; None where the system does not report it."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
