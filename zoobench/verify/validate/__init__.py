"""`zoobench validate`: the simulator against closed forms and published experiments, forward and gradient.

`base` says what a case is, `stage` moves scenes on, `suite` lists all cases, `plots` draws them; every other module
holds the cases of one family.
"""
