"""`python -m omnidyn`: the command line."""

import sys

from omnidyn.cli import main

if __name__ == "__main__":
    sys.exit(main())
