"""A process of the fuzzer's own: it reads inputs one by one and says what came of each."""

import faulthandler
import os
import resource
import tempfile
import time
from pathlib import Path
from random import Random

from fuzz_changes import change
from fuzz_files import put_beside, seeds

HANGS = 30.0  # seconds after which a process that is at one input is killed
STARTING, READING, COMPARING, DONE = range(4)


def made(kind: str, seed: int, index: int) -> bytes:
    """Make one input."""
    rng = Random(f"{seed} {kind} {index}")
    return change(kind, rng.choice(seeds(kind)), rng)


def work(kind, seed, indices, at, stage, spent, found, peers) -> None:
    """Put (index, fault or None, input or outcome) into `found`, an outcome for each input.

    `at`, `stage` and `spent` say where this process is and how much of a core's time it took.
    """
    import fuzz_peers
    from fuzz_readers import Fault, check, limit_memory

    if not os.environ.get("FUZZ_OUTPUT"):  # libraries talk there about damaged files
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    limit = resource.getrlimit(resource.RLIMIT_AS)
    memory = "/dev/shm"  # where files are in memory, on Linux
    with tempfile.TemporaryDirectory(dir=memory if os.path.isdir(memory) else None) as folder:
        path = Path(folder) / f"input.{kind}"
        put_beside(path)
        path.write_bytes(seeds(kind)[0])
        check(kind, path)  # what is loaded or compiled once counts against no input
        began = time.process_time()
        for index in indices:
            data = made(kind, seed, index)
            path.write_bytes(data)
            at.value, stage.value = index, READING
            faulthandler.dump_traceback_later(HANGS, exit=True)
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            limit_memory(len(data))
            try:
                result, warned = check(kind, path)
                outcome = (
                    "refused" if result is None else "read, and warned of" if warned else "read"
                )
            except Fault as fault:
                result, warned, outcome = None, True, "at fault"
                found.put((index, str(fault), data))
            finally:
                resource.setrlimit(resource.RLIMIT_AS, limit)
            grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) << 10
            if grown > 10 * len(data) + (200 << 20):
                found.put((index, f"took {grown >> 20} MB", data))
            if peers and result is not None and not warned:
                stage.value = COMPARING
                if said := fuzz_peers.disagreement(kind, path, fuzz_peers.summary(kind, result)):
                    found.put((index, said, data))
            faulthandler.cancel_dump_traceback_later()
            found.put((index, None, outcome))
            spent.value = time.process_time() - began
    stage.value = DONE
