"""Other people's ways to criticise a model, on the same bank and the same heaps as the search.

python -m experiments.evidence.trials.baselines.draw                         # the benchmark's banks and trials, once
python -m experiments.evidence.trials.baselines.run out/baselines            # every method on them
python -m experiments.evidence.trials.baselines.run out/measured out/trials  # a folder of measured trials, or a record
python -m experiments.evidence.trials.baselines.record out/baselines --out experiments/evidence/trials/record/baselines
"""
