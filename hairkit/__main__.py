"""`python -m hairkit` is the command line."""

import sys

from hairkit.cli import main

if __name__ == "__main__":
    sys.exit(main())
