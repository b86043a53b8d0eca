"""The reader's folder of experiments beside the others, and the page's first command."""

import pathlib

import experiments
from experiments.runner.cli import main

experiments.__path__.append(str(pathlib.Path("experiments").resolve()))
if main(["run", "mine.cutoff", "--no-progress"]):
    raise SystemExit("the experiment did not run")
