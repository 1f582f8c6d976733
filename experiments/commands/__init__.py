"""What the commands of ``experiments.cli`` do and show. Nothing is imported here: ``--help`` stays quick."""
