#!/usr/bin/python3
"""Repeats reconstructions and measures them; scripts/reproduce builds the program first."""

import argparse
import pathlib
import sys

from reproduction import results, strip
from reproduction.catalogue import RECONSTRUCTIONS
from reproduction.measure import ROOT, Failure, load, run, store


def parse(arguments):
    parser = argparse.ArgumentParser(prog="scripts/reproduce", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"all unless given; {', '.join(RECONSTRUCTIONS)}")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2], metavar="N", help="a run for each; default 1 2")
    parser.add_argument("--kind", choices=("shipped", "counterparts"), help="only those, where no name is given")
    parser.add_argument("--iterations", type=int, metavar="N", help="in place of the experiment's")
    parser.add_argument("--samples", type=int, metavar="N", help="per pixel, in place of the experiment's")
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "experiments", metavar="DIR",
                        help="folder of RESULTS.md, figures and measured; default experiments")
    parser.add_argument("--runs", type=pathlib.Path, default=ROOT / "runs/reproduce", metavar="DIR",
                        help="folder of the runs; default runs/reproduce")
    options = parser.parse_args(arguments)
    unknown = [n for n in options.names if n not in RECONSTRUCTIONS]
    if unknown:
        parser.error(f"there is no reconstruction {unknown[0]} (allowed: {', '.join(RECONSTRUCTIONS)})")
    if min(options.seeds) < 0:
        parser.error("--seeds: at least 0")
    for key in ("iterations", "samples"):
        if (getattr(options, key) or 1) < 1:
            parser.error(f"--{key}: at least 1")
    if not options.names:
        kinds = {"shipped": (False,), "counterparts": (True,), None: (False, True)}[options.kind]
        options.names = [n for n, e in RECONSTRUCTIONS.items() if bool(e.counterpart_of) in kinds]
    return options


def reproduce(name, options):
    entry = RECONSTRUCTIONS[name]
    table = options.output / f"measured/reconstructions/{name}.csv"
    for seed in options.seeds:
        folder = options.runs / f"{name}.{seed}"
        result, halfway = run(name, seed, folder, options.iterations, options.samples)
        others = [r for r in load(table) if r.seed != seed]
        store(table, sorted([*others, result], key=lambda r: r.seed))
        print(f"{name}, seed {seed}: {result.status}, {result.error_percent:.3g} % of the initial error, "
              f"{result.seconds:.0f} s, {result.cpu_seconds:.0f} CPU s, {result.peak_mib:.0f} MiB", flush=True)
        if seed == load(table)[0].seed:
            strip.render(name, entry, folder, halfway, options.samples)
            (options.output / "figures").mkdir(parents=True, exist_ok=True)
            strip.draw(name, entry, folder, options.output / f"figures/{name}.png")
    results.write(options.output)


def main(arguments):
    options = parse(arguments)
    failures = 0
    for name in options.names:
        try:
            reproduce(name, options)
        except Failure as failure:
            failures += 1
            print(f"scripts/reproduce: {name}: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
