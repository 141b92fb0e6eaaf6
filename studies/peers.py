"""Time functions of hairkit beside those of libraries, and check that results are the same.

python studies/peers.py --only distance

Prints a Markdown table: processor milliseconds over all threads, medians of runs by turns, and how
far the results are apart. Libraries that hairkit does not depend on are compared where they are
installed: `pip install libigl open3d pyamg scikit-image rtree`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator

import peer_surfaces
import peer_views
import peer_volumes
from peer_cases import Case, Row, measure

from hairkit.parallel import one_blas_thread, thread_count

CASES: list[Callable[[float], Iterator[Case]]] = [
    *peer_surfaces.CASES,
    *peer_volumes.CASES,
    *peer_views.CASES,
]
"""Functions of the size of the input, 1 for that of a reconstruction."""


@one_blas_thread()
def main() -> int:
    """Print a row a function and peer; 1 if a result is not the same."""
    args = _arguments()
    absent: dict[str, list[str]] = {}
    rows: list[Row] = []
    print(f"{thread_count()} threads, {args.rounds} rounds\n")
    print("| function | input | ours, ms | peer | peer, ms | times as fast | difference |")
    print("|---|---|---|---|---|---|---|")
    for case in (case for make in CASES for case in make(args.size)):
        if args.only and not any(word in case.name for word in args.only):
            continue
        for row in measure(case, args.rounds, lambda peer, module: _miss(absent, peer, module)):
            print(_line(row), flush=True)
            rows.append(row)
    for module, peers in absent.items():
        print(f"\nnot installed: {module}; left out: {', '.join(peers)}", end="")
    print()
    wrong = [row for row in rows if not row.agrees]
    for row in wrong:
        print(f"{row.case.name} and {row.peer} do not agree", file=sys.stderr)
    return 1 if wrong else 0


def _miss(absent: dict[str, list[str]], peer: str, module: str) -> None:
    absent.setdefault(module, []).append(peer)


def _line(row: Row) -> str:
    case = row.case
    apart = f"{row.difference:.2g} {case.unit}, allowed {case.allowed:g}"
    times = f"{row.ours_ms:.1f} | {row.peer} | {row.peer_ms:.1f} | {row.ratio:.1f}"
    return f"| {case.name} | {case.size} | {times} | {apart} |"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--only", nargs="*", metavar="WORD", help="functions whose name holds one of the words")
    add("--rounds", type=int, default=5, metavar="N", help="runs of each function")
    add("--size", type=float, default=1.0, help="share of the usual number of points and cells")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
