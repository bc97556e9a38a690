"""The same rounding on processors of different makes.

The libraries beneath look at the processor and choose their code by it: with wider vectors, sums are added up in
another order, and the last digits differ. A method that decides by them, as CMA-ES does with its eigenvectors, makes
other scores of that. So they are asked for the code that every x86 processor since about 2015 can run.
"""

import os
from pathlib import Path

CHOICES = {
    "OPENBLAS_CORETYPE": "Haswell",  # NumPy's and SciPy's linear algebra
    "ATEN_CPU_CAPABILITY": "avx2",  # torch's sums
    "MKL_CBWR": "COMPATIBLE",  # torch's products: the only choice that Intel promises for other makes, too
}
_NEEDS = {"avx2", "fma"}


def unify(processor: Path = Path("/proc/cpuinfo")) -> None:
    """Choose for libraries that are not loaded yet, here and in child processes; what is set already stays.

    Nothing is done where the processor's description is not found or lacks what the code needs.
    """
    try:
        with processor.open(encoding="utf-8", errors="replace") as lines:  # to the first core's flags, no further
            flags = next((line.partition(":")[2].split() for line in lines if line.startswith("flags")), [])
    except OSError:
        return
    if set(flags) >= _NEEDS:
        for name, value in CHOICES.items():
            os.environ.setdefault(name, value)
