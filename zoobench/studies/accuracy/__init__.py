"""`zoobench accuracy`: what accuracy costs in time."""
