"""``python -m master``."""

import sys

from master.safety.supervision import supervised


def _main() -> int:
    # Here, and so in the child alone: the parent waits and needs nothing.
    from master.commands.main import main

    return main()


if __name__ == "__main__":
    sys.exit(supervised(_main))
