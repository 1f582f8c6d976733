"""The command ``dem-warp``, in a file of its own: another package may be called `experiments`."""

import sys
from importlib.util import find_spec
from pathlib import Path


def main() -> None:
    """Run the command line, or name the package that Python finds in place of `experiments`."""
    spec, own = find_spec("experiments"), Path(__file__).with_name("experiments").resolve()
    if spec and own not in [Path(each).resolve() for each in spec.submodule_search_locations or ()]:
        found = Path(spec.origin or "experiments")
        place = found.parent if found.name == "__init__.py" else found
        message = f"Error: package experiments: {found} is not dem-warp's. Move or rename {place}"
        print(message, file=sys.stderr)
        raise SystemExit(2)
    from experiments import cli

    cli.main()
