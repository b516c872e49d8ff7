"""`viapoint` and `python -m viapoint`."""

import sys

from viapoint.cli import main

__all__ = ["main"]

if __name__ == "__main__":
    sys.exit(main())
