"""``python -m master``."""

import sys

# No file in the working folder (rich.py) stands in for a package, unless that folder is where this one was found.
if __name__ == "__main__" and not sys.flags.safe_path and sys.path[0] != __file__[: -len("/master/__main__.py")]:
    del sys.path[0]

from master.safety.supervision import supervised


def _main() -> int:
    # Here, and so in the child alone: the parent waits and needs nothing.
    from master.commands.main import main

    return main()


if __name__ == "__main__":
    sys.exit(supervised(_main))
