"""zoobench: which body, which brain and which algorithm wins in which environment."""

__version__ = "0.1.0"
