"""Is this bench fit to judge a device? Checks that a lab runs before it trusts one.

`python -m hil_tests.bench.conformance --can-bench desk.toml` prints one line a check; the
same checks serve as tests (`check_stage`, `check_server`). They look at the bench alone: a
device that breaks every requirement does not disturb them. What they find is a `Finding`;
each says what is wrong and what to do.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from hil_tests.bench import conformance_protocol as protocol
from hil_tests.bench import conformance_stage as stages
from hil_tests.errors import BenchError, ConfigError

if TYPE_CHECKING:
    from hil_tests.bench.real import RealStage
    from hil_tests.bench.stage import Stage
    from hil_tests.config import BenchFile, DeviceProfile


@dataclass(frozen=True, slots=True)
class Finding:
    """What one check found.

    Args:
        check: what must hold, in a sentence.
        wrong: what is wrong and what to do, a sentence each; () = all is well.
        skipped: why it was not checked; "" = it was.
    """

    check: str
    wrong: tuple[str, ...] = ()
    skipped: str = ""

    def __str__(self) -> str:
        if self.skipped:
            return f"-      {self.check} (not checked: {self.skipped})"
        lines = [f"{'WRONG' if self.wrong else 'ok':6s} {self.check}"]
        return "\n".join([*lines, *(f"         {text}" for text in self.wrong)])


def wrong(findings: Iterable[Finding]) -> list[str]:
    """Everything that is wrong, for a test's assertion."""
    return [f"{each.check} {text}" for each in findings for text in each.wrong]


def _find(check: Callable[[], Iterator[str]], text: str) -> Finding:
    """Carry out a check; a bench that breaks in it is its finding."""
    found: list[str] = []
    try:
        found.extend(check())
    except BenchError as error:
        found.append(str(error))
    return Finding(text, tuple(found))


def _sentence(check: Callable[..., object]) -> str:
    """What a check is about: the first line of its docstring."""
    return (check.__doc__ or "").strip().partition("\n")[0]


# The control server.


def check_server(
    address: str, declared: Sequence[str], profile: DeviceProfile, bit_rate: int
) -> list[Finding]:
    """Every check of a control server.

    Args:
        address: where it listens.
        declared: facilities that the bench file gives to it.
        profile: names of keys and LEDs.
        bit_rate: of the tester's end.
    """
    try:
        line = protocol.Line(address)
    except BenchError as error:
        return [Finding(_sentence(protocol.hello), (str(error),))]
    with contextlib.closing(line):
        findings = [_find(partial(protocol.hello, line, declared), _sentence(protocol.hello))]
        if findings[0].wrong:
            return findings
        for needs, check in _server_checks(line, profile, bit_rate):
            text = _sentence(check.func)
            if needs and needs not in line.hello["can"]:
                findings.append(Finding(text, skipped=f"its hello has no {needs}"))
            else:
                findings.append(_find(check, text))
    findings.append(_find(partial(protocol.bye, address), _sentence(protocol.bye)))
    return findings


def _server_checks(
    line: protocol.Line, profile: DeviceProfile, bit_rate: int
) -> Iterator[tuple[str, partial[Iterator[str]]]]:
    """What a check needs the server to declare, "" = nothing; and the check."""
    keys, leds = list(profile.key_bits), list(profile.led_bits)
    yield "", partial(protocol.garbage, line)
    yield "", partial(protocol.order, line)
    yield "power", partial(protocol.power, line)
    if keys:
        yield "keys", partial(protocol.keys, line, keys)
        yield "key-sequences", partial(protocol.sequences, line, keys)
    if profile.faults:
        yield "faults", partial(protocol.faults, line, list(profile.faults))
    if leds:
        yield "leds", partial(protocol.leds, line, leds)
        yield "led-edges", partial(protocol.edges, line, leds)
    yield "bus", partial(protocol.bus, line, bit_rate)


# The stage: port and drivers, whatever stands behind them.


def check_stage(stage: Stage, profile: DeviceProfile) -> list[Finding]:
    """Every check of a port and its drivers; the device is left on, with no key held."""
    tester = stages.Tester(stage)
    table: list[tuple[Callable[[stages.Tester, DeviceProfile], Iterator[str]], str]] = [
        (stages.supply, "power"),
        (stages.own_frames, ""),
        (stages.waiting, ""),
        (stages.held_keys, "keys"),
        (stages.raised_errors, "faults"),
        (stages.lights, "leds"),
        (stages.light_edges, "leds"),
    ]
    lacks = {"keys": not profile.key_bits, "leds": not profile.led_bits}
    lacks["faults"] = not profile.faults
    findings = []
    for check, needs in table:
        if lacks.get(needs):
            continue  # the device has none
        if needs and getattr(stage, needs) is None:
            findings.append(Finding(_sentence(check), skipped=f"the bench has no {needs}"))
        else:
            findings.append(_find(partial(check, tester, profile), _sentence(check)))
    return findings


# The command.


def open_stage(file: BenchFile, profile: DeviceProfile, leave: ExitStack) -> RealStage:
    """The stage that a bench file describes.

    Raises:
        BenchError: bus or control server unavailable.
    """
    from hil_tests.bench import real  # noqa: PLC0415 - the drivers
    from hil_tests.bus.choose import open_port  # noqa: PLC0415

    port = open_port(file.bus.interface or "socketcan", file.bus.channel or "", file.bus.bitrate)
    leave.callback(port.close)
    rate = file.bus.bitrate or profile.factory.bit_rate
    stage = real.RealStage(
        file.name, port, rate, exclusive=file.bus.exclusive, writes_allowed=False, leave=leave
    )
    session = (
        real.open_session(stage, file.control.address, leave, real.patience(file))
        if file.control
        else None
    )
    real.fit_from_file(stage, file, profile, session, None)
    real.keep_power(stage, session, leave)
    if stage.bitrate is not None:
        stages.Tester(stage).carry_out(stage.bitrate.set(rate))
    return stage


def check_bench(file: BenchFile, profile: DeviceProfile) -> Iterator[Finding]:
    """Every check of the bench in a file: its control server, then port and drivers."""
    if file.control:
        declared = [name for name in file.facilities if getattr(file, name).driver == "control"]
        rate = file.bus.bitrate or profile.factory.bit_rate
        yield from check_server(file.control.address, declared, profile, rate)
    with ExitStack() as leave:
        yield from check_stage(open_stage(file, profile, leave), profile)


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a bench and print a line a check.

    Returns:
        0 all is well, 1 something is wrong, 4 the files are, 11 the bench is unavailable.
    """
    from hil_tests.config import load_bench, load_profile  # noqa: PLC0415 - costs attrs

    parser = argparse.ArgumentParser(
        prog="python -m hil_tests.bench.conformance",
        description="Is this bench fit to judge a device? It switches the supply, moves the keys "
        "and sends frames with the unused identifier 6FEh; nothing is stored.",
    )
    parser.add_argument("--can-bench", metavar="FILE", required=True, help="the bench file")
    parser.add_argument("--can-profile", metavar="NAME|FILE", help="of the device on it")
    chosen = parser.parse_args(arguments)
    status = 0
    try:
        file = load_bench(chosen.can_bench)
        profile = load_profile(chosen.can_profile or file.device.profile or "keypad")
        for finding in check_bench(file, profile):
            sys.stdout.write(f"{finding}\n")
            status = 1 if finding.wrong else status
    except ConfigError as error:
        sys.stderr.write(f"{error}\n")
        return 4
    except BenchError as error:
        sys.stderr.write(f"bench unavailable: {error}\n")
        return 11
    return status


if __name__ == "__main__":
    sys.exit(main())
