"""The folder that the page reads, by its first lines' command."""

from experiments.runner.cli import main

options = "--size 160 --folder dataset --directions 32 --bounces 1 --views 3 --no-progress"
if main(["run", "dataset", *options.split()]):
    raise SystemExit("the experiment did not run")
