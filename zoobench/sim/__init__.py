"""The differentiable MLS-MPM simulator of matter and boundaries, independent of tasks, databases and commands."""

import os

# Taichi prints a banner on standard output, which is reserved for data, when it is imported
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
