"""`python -m hil_tests.vm`, the same as `nodeproof vcan`."""

import argparse
import sys

from hil_tests.vm import command


def main() -> int:
    """Runs the command line and returns its exit status."""
    parser = argparse.ArgumentParser(prog="nodeproof vcan")
    command.add_arguments(parser)
    return command.run(parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
