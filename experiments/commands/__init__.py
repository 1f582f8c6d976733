"""Commands of ``experiments.cli``: their work and output. It imports nothing: ``--help`` stays quick."""
