"""``python -m models``: physics without FMI."""

import sys

from models.commands.physics_interruption import watch_interruptions
from models.commands.physics_main import main

if __name__ == "__main__":
    watch_interruptions()
    sys.exit(main(sys.argv[1:]))
