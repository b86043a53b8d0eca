"""Fuzz the readers: `python tests/fuzz --inputs 1000000`, or `make fuzz`.

An input follows from format, seed and index alone, so that each can be made again:
`python tests/fuzz --formats obj --seed 0 --start 1234 --inputs 1`. What fails is printed with its
index and kept in `results/fuzz`; the run goes on, and fails at its end.
"""

import argparse
import itertools
import multiprocessing
import os
import queue
import sys
from collections import Counter
from pathlib import Path

import fuzz_work
from fuzz_files import FORMATS
from fuzz_peers import missing
from fuzz_work import COMPARING, READING, made, work
from tqdm import tqdm

ROOT = Path(__file__).parents[2]


class Run:
    """All inputs of one format, shared out between processes that may crash."""

    def __init__(self, kind: str, options):
        self.kind, self.options = kind, options
        self.stop = options.start + options.inputs
        self.context = multiprocessing.get_context("spawn")
        self.found = self.context.Queue()
        self.outcomes: Counter[str] = Counter()
        self.faults: Counter[str] = Counter()
        self.workers = []
        self.spent = []

    def begin(self, start: int) -> None:
        """Start a process at an input, if there is one."""
        if start >= self.stop:
            return
        at, stage = self.context.Value("q", start), self.context.Value("i", 0)
        self.spent.append(self.context.Value("d", 0.0))
        indices = range(start, self.stop, self.options.workers)
        peers = not self.options.without_peers
        place = (at, stage, self.spent[-1])
        given = (self.kind, self.options.seed, indices, *place, self.found, peers)
        process = self.context.Process(target=work, args=given, daemon=True)
        process.start()
        self.workers.append((process, at, stage))

    def bury(self) -> int:
        """Put another in the place of each process that died; give how many inputs that cost."""
        dead = [worker for worker in self.workers if worker[0].exitcode]
        for worker in dead:
            process, at, stage = worker
            self.workers.remove(worker)
            if stage.value == READING:
                how = f"crashed or hung for {fuzz_work.HANGS:g} s: exit code {process.exitcode}"
                self.report(at.value, how, made(self.kind, self.options.seed, at.value))
            elif stage.value == COMPARING:
                self.outcomes["crashed another package"] += 1
            else:
                raise SystemExit(f"{self.kind}: a process did not start; FUZZ_OUTPUT=1 shows why")
            self.begin(at.value + self.options.workers)
        return len(dead)

    def report(self, index: int, what: str, data: bytes) -> None:
        """Print a fault, and keep its input, unless enough of its kind were met."""
        sort = "".join(itertools.takewhile(lambda c: c not in "0123456789'[", what))[:60]
        self.faults[sort] += 1
        if self.faults[sort] > self.options.of_a_kind:
            return
        self.options.out.mkdir(parents=True, exist_ok=True)
        path = self.options.out / f"{self.options.seed}-{index}.{self.kind}"
        path.write_bytes(data)
        tqdm.write(f"{self.kind} {index} (seed {self.options.seed}), kept as {path}: {what}")

    def __call__(self) -> int:
        """Read all; give the number of kinds of fault."""
        options = self.options
        for i in range(options.workers):
            self.begin(options.start + i)
        with tqdm(total=options.inputs, desc=self.kind, unit=" inputs", disable=None) as bar:
            while True:
                ended = all(process.exitcode == 0 for process, *_ in self.workers)
                try:
                    index, what, more = self.found.get(timeout=0.2)
                except queue.Empty:
                    if ended:
                        break
                    bar.update(self.bury())
                    continue
                if what is None:
                    self.outcomes[more] += 1
                    bar.update()
                else:
                    self.report(index, what, more)
        seconds = sum(one.value for one in self.spent)
        rate = options.inputs / max(seconds, 1e-3)
        counts = ", ".join(f"{count} {what}" for what, count in sorted(self.outcomes.items()))
        print(
            f"{self.kind}: {options.inputs} inputs at {rate:.0f} a second of one core, a million "
            f"in {1e6 / rate / 60:.0f} minutes: {counts}; "
            f"{len(self.faults)} kinds of fault {dict(self.faults) or ''}",
            flush=True,
        )
        return len(self.faults)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=1_000_000, help="inputs, of each format")
    parser.add_argument("--formats", nargs="+", choices=FORMATS, default=FORMATS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=int, default=0, help="index of the first input")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--without-peers", action="store_true", help="read by our readers alone")
    parser.add_argument("--of-a-kind", type=int, default=3, help="faults of a kind to print")
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "fuzz")
    options = parser.parse_args()
    # For the processes that read: those start with this path and this environment.
    sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "geometry")]
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    faults = 0
    for kind in options.formats:
        for name in [] if options.without_peers else missing(kind):
            print(f"{kind}: not compared with {name}, which is not installed")
        faults += Run(kind, options)()
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
