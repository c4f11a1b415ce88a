"""``python -m models``: physics without FMI."""

import sys

from models.commands import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
