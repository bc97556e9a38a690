"""The differentiable MLS-MPM simulator: it knows matter and boundaries, nothing of tasks, databases or commands."""

import os

# Taichi prints a banner on standard output when it is imported; standard output is for data
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
