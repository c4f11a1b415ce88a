"""``python -m models``: physics without FMI."""

import sys

from models.commands import main
from models.commands.physics_interruption import watch_interruptions

if __name__ == "__main__":
    watch_interruptions()
    sys.exit(main(sys.argv[1:]))
