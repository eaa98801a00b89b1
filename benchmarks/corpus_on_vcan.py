"""Which faults the stored scenarios show over a real SocketCAN interface, and whom they harm.

    nodeproof vcan --vm -- python -m benchmarks.corpus_on_vcan
    nodeproof vcan --vm -- python -m benchmarks.corpus_on_vcan --variants

Each faulty model is hosted in a process of its own and plays the scenarios that are known to
show it, until one blames a requirement that it violates. With --variants every conforming
model plays them all. What needs a bus load is left out: a vcan has no arbitration.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager

from hil_tests.bench import real
from hil_tests.bench.drivers.model import HostedModel
from hil_tests.bench.keypad import KeypadBench
from hil_tests.bus.choose import open_port
from hil_tests.config import KeypadProfile, load_keypad
from hil_tests.judge.verdict import NotRun, Outcome, Verdict
from hil_tests.scenarios.corpus import Stored, is_timed, stored
from hil_tests.scenarios.play import play
from node_model.faults import MUTANTS, VARIANTS


@contextmanager
def hosted(
    profile: KeypadProfile, name: str, interface: str, channel: str
) -> Iterator[KeypadBench]:
    """A bench with one model."""
    with ExitStack() as leave:
        port = open_port(interface, channel, None)
        leave.callback(port.close)
        stage = real.RealStage(
            "vcan", port, profile.factory.bit_rate, exclusive=True, writes_allowed=True,
            leave=leave, fades=False,
        )  # fmt: skip
        model = HostedModel(interface, channel, profile.path, name)
        leave.callback(model.close)
        session = real.open_session(stage, model.address, leave)
        real.fit_control(
            stage, session, ("power", "keys", "leds", "bitrate"), list(profile.led_bits)
        )
        bench = KeypadBench(stage, profile, profile.factory)
        if bench.bitrate:
            bench.bitrate.set(stage.bit_rate)
        yield bench


def failures(bench: KeypadBench, stories: Sequence[Stored]) -> Iterator[Verdict]:
    """What is certainly wrong, scenario after scenario."""
    for each in stories:
        bench.begin()
        try:
            verdicts = play(bench, each.scenario)
        except NotRun as reason:
            print(f"    {each.name}: {reason}")
            continue
        yield from (verdict for verdict in verdicts if verdict.outcome is Outcome.FAIL)


def blame(verdicts: Iterator[Verdict], violates: set[str]) -> tuple[bool, list[str]]:
    """Whether one of the violated requirements is blamed, and all that was by then."""
    found: list[str] = []
    for verdict in verdicts:
        found.append(verdict.requirement)
        if verdict.requirement in violates:
            return True, found
    return False, found


def kills(corpus: Sequence[Stored], names: Sequence[str], interface: str, channel: str) -> int:
    """Every faulty model that the corpus knows; 0 where at least 95 % are blamed."""
    profile = load_keypad("keypad")
    killed, shown = 0, 0
    for name in names:
        stories = [each for each in corpus if name in each.finds]
        if not stories:
            print(f"{name}: no stored scenario shows it on an untimed wire", flush=True)
            continue
        shown += 1
        with hosted(profile, name, interface, channel) as bench:
            blamed, found = blame(failures(bench, stories), set(MUTANTS[name].violates))
        killed += blamed
        print(f"{'ok ' if blamed else 'BAD'} {name}: {', '.join(found)}", flush=True)
    print(f"{killed} of {shown} blamed, of {len(names)} in all")
    return int(killed < 0.95 * shown)


def harm(corpus: Sequence[Stored], names: Sequence[str], interface: str, channel: str) -> int:
    """Every conforming model, and everything stored."""
    profile, harmed = load_keypad("keypad"), 0
    for name in names:
        departs = set(VARIANTS[name].departs)
        began = time.monotonic()
        with hosted(profile, name, interface, channel) as bench:
            wrong = [str(v) for v in failures(bench, corpus) if v.requirement not in departs]
        harmed += bool(wrong)
        took = time.monotonic() - began
        print(
            f"{'BAD' if wrong else 'ok '} {name} {took:.0f} s {'; '.join(wrong[:3])}", flush=True
        )
    print(f"{harmed} of {len(names)} harmed")
    return int(bool(harmed))


def main() -> int:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--variants", action="store_true", help="conforming models instead")
    parser.add_argument("--interface", default="socketcan")
    parser.add_argument("--channel", default="vcan0")
    parser.add_argument("--model", action="append", metavar="NAME", help="only this one")
    options = parser.parse_args()
    corpus = [each for each in stored("keypad") if not is_timed(each)]
    work, names = (harm, VARIANTS) if options.variants else (kills, MUTANTS)
    chosen = options.model or list(names)
    return work(corpus, chosen, options.interface, options.channel)


if __name__ == "__main__":
    sys.exit(main())
