"""`hairkit` and `python -m hairkit` are the command line.

Loads nothing at first: from here on Ctrl-C gets its one line, also while the rest loads.
"""

import sys


def main() -> int:
    """Run the command line and return its exit code."""
    try:
        from hairkit.cli import main as run

        return run()
    except KeyboardInterrupt:
        print("hairkit: interrupted", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
