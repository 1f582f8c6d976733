"""Commands of ``experiments.cli``: their work and output. It imports nothing, so that ``--help`` stays quick."""
