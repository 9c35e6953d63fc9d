"""`python -m dynakin` is the command `dynakin`."""

import sys

from dynakin.cli import main

if __name__ == "__main__":  # processes of a pool load it, too
    sys.exit(main())
