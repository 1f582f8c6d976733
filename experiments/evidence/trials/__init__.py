"""Blind trials of the analysis: data with a hidden effect, by a generator kept apart, analysed and scored.

    dem-warp discover experiments/studies/trial/study.toml --out out/bank     # the bank, once
    python -m experiments.evidence.trials.generate seal out/trials            # draws and seals the truths
    python -m experiments.evidence.trials.run out/trials --plan-only          # what it will cost
    python -m experiments.evidence.trials.generate measure out/trials         # the heaps
    python -m experiments.evidence.trials.run out/trials                      # the analyses
    python -m experiments.evidence.trials.record out/trials --out out/record  # reveals, scores, records

The seals are to be published before the heaps are measured.
"""
