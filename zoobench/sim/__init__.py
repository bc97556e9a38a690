"""The differentiable MLS-MPM simulator of matter and boundaries, independent of tasks, databases and commands."""

import os

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
