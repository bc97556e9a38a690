"""The cells of the benchmark as Gymnasium environments: `gymnasium.make("zoobench/Desert-Caterpillar-Turning-v0")`.

Gymnasium finds them by itself where zoobench is installed; it and stable-baselines3 come with `zoobench[ppo]`.
"""
