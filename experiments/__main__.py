"""Run the experiments: ``python -m experiments --help``."""

import sys

from .runner.cli import main

sys.exit(main())
