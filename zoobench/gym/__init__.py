"""The cells of the benchmark as Gymnasium environments: `gymnasium.make("zoobench/Desert-Caterpillar-Turning-v0")`.

Importing this package registers the names: `import zoobench.gym` first, or write
`gymnasium.make("zoobench.gym:zoobench/Desert-Caterpillar-Turning-v0")`. Gymnasium and stable-baselines3 are installed
with `zoobench[ppo]`.
"""

try:
    from zoobench.gym.registration import register_envs
except ModuleNotFoundError as error:
    advice = f"zoobench.gym needs {error.name}, which is not installed. Try: pip install 'zoobench[ppo]'."
    raise ModuleNotFoundError(advice, name=error.name) from None

register_envs()
