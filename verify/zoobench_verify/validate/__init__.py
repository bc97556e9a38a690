"""`zoobench verify validate`: the simulator against closed forms and published experiments, forward and gradient."""
