# SPDX-License-Identifier: Apache-2.0
"""Command line of the laboratory: `python3 -m lab SUBCOMMAND --help`."""
import argparse
import sys

from lab import (bench, calibrations, changes, core, covariances, findings, growth, hashes, judge, maps, merging, paper_docs, reproduce,
                 sequences, starts, surface, view, vocabulary, zones)

SUBCOMMANDS = {"sequences": sequences, "starts": starts, "hashes": hashes, "bench": bench, "maps": maps,
               "calibrations": calibrations, "changes": changes, "covariances": covariances, "growth": growth, "findings": findings, "judge": judge,
               "merging": merging, "paper_docs": paper_docs, "reproduce": reproduce, "surface": surface, "view": view, "zones": zones,
               "vocabulary": vocabulary}


def main(words=None):
    parser = argparse.ArgumentParser(prog="python3 -m lab", description=__doc__.splitlines()[0])
    subparsers = parser.add_subparsers(dest="subcommand", required=True)
    for name, module in SUBCOMMANDS.items():
        subparser = subparsers.add_parser(name, help=module.__doc__.splitlines()[0], description=module.__doc__,
                                          formatter_class=argparse.RawDescriptionHelpFormatter)
        module.add_arguments(subparser)
        subparser.set_defaults(main=module.main, error=subparser.error)
    arguments = parser.parse_args(words)
    try:
        return arguments.main(arguments)
    except core.Failed as problem:
        print(f"lab {arguments.subcommand}: {problem}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
