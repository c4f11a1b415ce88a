"""``python -m models``: physics without FMI."""

import sys

# No file in the working folder (rich.py) stands in for a package, unless that folder is where this one was found.
if __name__ == "__main__" and not sys.flags.safe_path and sys.path[0] != __file__[: -len("/models/__main__.py")]:
    del sys.path[0]

from models.commands.physics_interruption import watch_interruptions
from models.commands.physics_main import main

if __name__ == "__main__":
    watch_interruptions()
    sys.exit(main(sys.argv[1:]))
