"""Run the experiments.

python -m experiments list
    the experiments: what each shows, what of which paper, its presets

python -m experiments run NAME... [options] [overrides]
    run them and write results/NAME/PRESET/

python -m experiments report [NAME...] [--all] [--preset PRESET] [--out results]
    write report.html and report.md over the results, claims first; --all runs before what is
    missing or stale

python -m experiments findings [--out results] [--preset quick]
    fill each paper's README from its findings.md and the metrics of the runs

python -m experiments readme [--out results] [--preset paper]
    fill README.md's figures from the metrics of the runs

python -m experiments run --help
    the options

python -m experiments run NAME --help
    the fields of the experiment's config, each of which is an override (--degrees 1 2 4)
"""

import argparse
import itertools
import shlex
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from . import findings, overview, readme
from .config import fill, override
from .data import VARIABLE, Data
from .errors import UserError, unknown
from .registry import Entry, entries, load
from .results import damaged
from .run import Job

_PROGRAM = "python -m experiments"


def main(arguments: Sequence[str] | None = None) -> int:
    """The exit code: 0 done, 1 an experiment failed, 2 a mistake of the user's, 130 Ctrl-C."""
    try:
        command, *rest = (sys.argv[1:] if arguments is None else arguments) or ["--help"]
        if command == "run":
            return _run(rest)
        if command == "report":
            return _report(rest)
        if command == "findings":
            return _findings(rest)
        if command == "readme":
            return _readme(rest)
        if command not in ("list", "-h", "--help"):
            raise unknown("command", command, ["list", "run", "report", "findings", "readme"])
        if rest:
            raise UserError(f"{command}: unexpected argument {rest[0]!r}")
        print(_listing(entries()) if command == "list" else __doc__)
        return 0
    except UserError as error:
        return _complain(error)


def _listing(known: dict[str, Entry]) -> str:
    """The table that `list` prints."""
    lines = [("experiment", "presets", "description", "reproduces")]
    for entry in known.values():
        lines.append((entry.name, " ".join(entry.presets), entry.description, entry.reproduces))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    padded = (map(str.ljust, line, widths) for line in lines)
    return "\n".join("  ".join(line).rstrip() for line in padded)


def _findings(arguments: list[str]) -> int:
    options, rest = _parser().parse_known_args(arguments)
    if rest:
        raise UserError(f"findings: unexpected argument {rest[0]!r}")
    print(*findings.fill(entries(), options.out, options.preset), sep="\n")
    return 0


def _readme(arguments: list[str]) -> int:
    parser = _Parser(prog=f"{_PROGRAM} readme", description=readme.__doc__, allow_abbrev=False)
    add = parser.add_argument
    add("--out", type=Path, default=Path("results"), help="folder of the results (results)")
    add("--preset", default="paper", help="whose results are taken up (paper)")
    options = parser.parse_args(arguments)
    print(*readme.renew(options.out, options.preset), sep="\n")
    return 0


def _report(arguments: list[str]) -> int:
    parser = _Parser(prog=f"{_PROGRAM} report", description=overview.__doc__, allow_abbrev=False)
    add = parser.add_argument
    add("names", nargs="*", metavar="NAME", help="experiments, or papers' folders (all)")
    add(
        "--all",
        action="store_true",
        help="run what is missing or stale before; goes on where it was interrupted",
    )
    add("--preset", help="results of this preset alone (paper where there are, else the newest)")
    add("--data", type=Path, help=f"for --all: folder with meshes and envmaps (${VARIABLE})")
    add("--out", type=Path, default=Path("results"), help="folder of the results (results)")
    add("--seed", type=int, default=0, help="for --all: seed of the random numbers (0)")
    add("--no-progress", action="store_false", dest="progress", help="no progress bars")
    options = parser.parse_args(arguments)
    known, code = entries(), 0
    if options.preset and not any(options.preset in entry.presets for entry in known.values()):
        presets = dict.fromkeys(name for entry in known.values() for name in entry.presets)
        raise unknown("preset", options.preset, presets)
    chapters = overview.collect(known, options.names, options.out, options.preset)
    if options.all:
        data = Data.find(options.data)

        def run(entry: Entry, preset: str) -> None:
            chosen = argparse.Namespace(**vars(options) | {"preset": preset})
            job = _job(entry.name, known, chosen, [], data)
            try:
                job.run()
            finally:
                _forget()

        code = overview.run_due(overview.due(chapters, options.preset), run)
        chapters = overview.collect(known, options.names, options.out, options.preset)
    for chapter in chapters:
        for entry, _ in chapter.runs:
            for said in damaged(entry, options.out):
                print(f"warning: {said}", file=sys.stderr)
    print(*overview.write_pages(chapters, options.out, _PROGRAM + " report"), sep="\n")
    return code


def _forget() -> None:
    """Drop what JAX has compiled: of all experiments together it would be gigabytes."""
    import jax

    jax.clear_caches()


def _run(arguments: list[str]) -> int:
    names = list(itertools.takewhile(lambda word: not word.startswith("-"), arguments))
    parser = _parser()
    options, overrides = parser.parse_known_args(arguments[len(names) :])
    if not names and options.help:
        parser.print_help()
        return 0
    if not names:
        raise UserError("run: the names of the experiments come first (`list` shows them)")
    if len(names) > 1 and (overrides or options.help):
        raise UserError("run: overrides and --help are for one experiment at a time")
    if options.help:
        overrides = ["--help"]
    known = entries()
    data = Data.find(options.data)
    # Every job is made before the first one runs: a mistake shows at once, not after an hour.
    return _run_all([_job(name, known, options, overrides, data) for name in names])


def _run_all(jobs: list[Job]) -> int:
    """Run the jobs; one that fails does not keep the others from running."""
    code, failed = 0, []
    for job in jobs:
        print(f"{job.entry.name} · {job.preset}: {job.entry.description}", file=sys.stderr)
        try:
            print(job.run() / "table.md")
        except UserError as error:
            code = max(code, _complain(error))
            failed.append(job.entry.name)
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            return 130
        except Exception:
            traceback.print_exc()
            code = 1
            failed.append(job.entry.name)
    if failed:
        print(f"{len(failed)} of {len(jobs)} failed: {', '.join(failed)}", file=sys.stderr)
    return code


def _job(
    name: str,
    known: dict[str, Entry],
    options: argparse.Namespace,
    overrides: list[str],
    data: Data,
) -> Job:
    if name not in known:
        raise unknown("experiment", name, known)
    entry = known[name]
    values = entry.preset(options.preset)
    experiment = load(entry)
    config = fill(experiment.config, values, where=f"{entry.file} [{options.preset}]")
    config = override(
        config,
        overrides,
        prog=f"run {name}",
        description=f"{entry.description.rstrip('.')}. The defaults are those of the preset"
        f" {options.preset!r}; `{_PROGRAM} run --help` shows the runner's own options.",
    )
    return Job(
        entry=entry,
        experiment=experiment,
        preset=options.preset,
        config=config,
        command=_command(name, options, overrides, data),
        out=options.out,
        data=data,
        seed=options.seed,
        progress=options.progress,
    )


def _command(name: str, options: argparse.Namespace, overrides: list[str], data: Data) -> str:
    """The line that runs the experiment again, wherever the data's folder was named."""
    words = [name, "--preset", options.preset]
    words += ["--seed", str(options.seed)] if options.seed else []
    words += ["--data", str(data.folder)] if data.folder else []
    words += ["--out", str(options.out)] if options.out != Path("results") else []
    return f"{_PROGRAM} run {shlex.join([*words, *overrides])}"


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise UserError(f"{self.prog.removeprefix(_PROGRAM).strip()}: {message}")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog=f"{_PROGRAM} run",
        usage=f"{_PROGRAM} run NAME... [options] [overrides of one experiment's config]",
        description="Run experiments, each into OUT/NAME/PRESET/.",
        add_help=False,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("-h", "--help", action="store_true", help="this text, or the config's after a NAME")
    add("--preset", default="quick", help="table of the TOML file to start from (quick)")
    add("--data", type=Path, help=f"folder with meshes/*.ply, envmaps/*.exr (${VARIABLE})")
    add("--out", type=Path, default=Path("results"), help="folder for the results (results)")
    add("--seed", type=int, default=0, help="seed of the run's random numbers (0)")
    add("--no-progress", action="store_false", dest="progress", help="no progress bars")
    return parser


def _complain(error: UserError) -> int:
    print(f"error: {error}", file=sys.stderr)
    return 2
