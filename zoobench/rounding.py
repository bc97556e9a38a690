"""Equal rounding on different processors.

Numerical libraries choose their code by the processor: with wider vector registers they sum in another order, and
results differ in the last bits. Methods amplify such differences, as CMA-ES does by its eigenvectors. The libraries are
therefore set to code that every x86 processor since about 2015 can run.
"""

import os
from pathlib import Path

CHOICES = {
    "OPENBLAS_CORETYPE": "Haswell",  # NumPy's and SciPy's linear algebra
    "ATEN_CPU_CAPABILITY": "avx2",  # torch's sums
    "MKL_CBWR": "COMPATIBLE",  # torch's products: the only setting that Intel guarantees on other processors, too
}
_NEEDS = {"avx2", "fma"}


def unify(processor: Path = Path("/proc/cpuinfo")) -> None:
    """Set the choices for libraries not yet loaded, here and in child processes; variables already set are kept.

    Does nothing if the processor's description is missing or lacks the required features.
    """
    try:
        with processor.open(encoding="utf-8", errors="replace") as lines:  # the first core's flags are enough
            flags = next((line.partition(":")[2].split() for line in lines if line.startswith("flags")), [])
    except OSError:
        return
    if set(flags) >= _NEEDS:
        for name, value in CHOICES.items():
            os.environ.setdefault(name, value)
