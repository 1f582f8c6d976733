"""Commands of ``experiments.cli``: their work and output. Nothing is imported here: ``--help`` stays quick."""
