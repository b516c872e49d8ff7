"""All benchmarks in one go; every one also runs alone. What `make bench` calls.

python benchmarks/run.py [--quick] [name ...]
"""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Benchmark:
    """A script beside this one: what it takes to be quick, and packages that it cannot do without."""

    name: str
    quick: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()


BENCHMARKS = (
    Benchmark("simulation", quick=("--quick",)),
    Benchmark("oracles", quick=("--quick",), needs=("toppra", "casadi")),
    Benchmark("linuxcnc"),
    Benchmark("streaming", quick=("--blocks", "4000")),
    Benchmark("timing"),
    Benchmark("commands", quick=("100",)),
    Benchmark("random_programs", quick=("200",)),
    Benchmark("language_speed", quick=("--lines", "20000", "--rounds", "2")),
    Benchmark("recording"),
    Benchmark("tracking"),
    Benchmark("workspace"),
)
"""In the order in which they run: what is judged first."""


def missing(benchmark: Benchmark) -> list[str]:
    """Packages that are not installed."""
    return [name for name in benchmark.needs if importlib.util.find_spec(name) is None]


def run(benchmark: Benchmark, quick: bool) -> bool:
    """Run one in a process of its own, so that none warms up another; True if it ended well."""
    print(f"\n=== {benchmark.name} ===\n", flush=True)
    lacking = missing(benchmark)
    if lacking:
        print(f"needs {' and '.join(lacking)}: pip install 'viapoint[bench]'")
        return False
    words = [sys.executable, str(HERE / f"{benchmark.name}.py"), *(benchmark.quick if quick else ())]
    begin = time.perf_counter()
    done = subprocess.run(words, cwd=HERE, check=False)
    print(f"\n{benchmark.name}: {time.perf_counter() - begin:.0f} s", flush=True)
    return done.returncode == 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; the exit code is 1 if a benchmark could not be run to its end."""
    names = [benchmark.name for benchmark in BENCHMARKS]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="smaller workloads, for a first look")
    parser.add_argument("names", nargs="*", metavar="name", help=f"one or more of {', '.join(names)}")
    chosen = parser.parse_args(arguments)
    unknown = [name for name in chosen.names if name not in names]
    if unknown:
        parser.error(f"no benchmark {unknown[0]}; there are {', '.join(names)}")
    wanted = [b for b in BENCHMARKS if not chosen.names or b.name in chosen.names]
    failed = [b.name for b in wanted if not run(b, chosen.quick)]
    print(f"\n{len(wanted) - len(failed)} of {len(wanted)} benchmarks ran" + _named(failed))
    return 1 if failed else 0


def _named(failed: Sequence[str]) -> str:
    return f"; not {', '.join(failed)}" if failed else ""


if __name__ == "__main__":
    sys.exit(main())
