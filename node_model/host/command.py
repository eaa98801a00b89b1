"""The command `python -m node_model`: hosts a node, or several, until it is told to end.

It prints one line, `ready control=ADDRESS channel=NAME`, once the bus is open and the
control server listens. Without `--control` the node is powered at once; with it the node
is off until the client switches it on. Several nodes (`--node-id 1-10`) hear each other as
on a bus (`node_model.host.segment`); memory and control are for one.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import re
import select
import signal
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from node_model import devices
from node_model.host import memory
from node_model.host.control import Server
from node_model.host.loop import Loop
from node_model.host.segment import Segment
from node_model.host.verbs import Verbs
from node_model.host.wires import SocketCanWire, Wire, WireError
from node_model.node import MS, US, Node, Panel, S

_SPIN_NS = 200 * US if len(os.sched_getaffinity(0)) > 1 else 0
"""How long before a deadline to stop sleeping: a wake-up is up to 0.1 ms late. On a single
processor spinning would only keep the tester from running."""

_NO_DESCRIPTOR_NS = 1 * MS
"""How often to look at an interface that select cannot wait for."""
_LONGEST_NS = 60 * S
_LONG_NS = 5 * MS
_SLACK_SHARE = 500
"""Linux may serve a time-out of select late by a thousandth of its length (fs/select.c,
select_estimate_accuracy): a long wait is made in two, nearly all of it and the rest."""


def arguments() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser("node_model", description="Host a model of a CANopen node.")
    add = parser.add_argument
    add("--profile", default="keypad", help="bundled device profile, or a TOML file")
    add("--channel", required=True, help="CAN channel, e.g. vcan0")
    add("--interface", default="socketcan", help="python-can interface type")
    add(
        "--node-id",
        type=node_ids,
        metavar="N[-M]",
        help="overrides the profile's; a range, e.g. 1-10, hosts as many nodes on one bus",
    )
    add("--eds", help="EDS file of the device; with --profile generic, any")
    add("--mutant", help="host a named faulty model")
    add("--storage", type=Path, help="file that keeps the memory of one node")
    add(
        "--leash",
        action="store_true",
        help="end with standard input, so as not to outlive who starts it",
    )
    add("--control", help="serve the bench control protocol, one node: tcp:HOST:PORT or unix:PATH")
    return parser


def node_ids(text: str) -> range:
    """The node ids that `5` or `1-10` means."""
    found = re.fullmatch(r"([0-9]+)(?:-([0-9]+))?", text)
    first, last = (int(found[1]), int(found[2] or found[1])) if found else (1, 0)
    if first > last:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither a node id nor a range of them; write e.g. 5, or 1-10"
        )
    return range(first, last + 1)


def main(argv: Sequence[str] | None = None, say: Callable[[str], None] = print) -> int:
    """Run the command; returns the exit status: 0 ended, 2 wrong use or no bus."""
    parser = arguments()
    options = parser.parse_args(argv)
    if len(options.node_id or ()) > 1:
        for name in ("control", "storage"):
            if getattr(options, name):
                parser.error(
                    f"--{name} is for one node, and --node-id asks for {len(options.node_id)}; "
                    "leave one of the two out, or run a process for each node"
                )
    try:
        with contextlib.ExitStack() as stack:
            nodes = nodes_of(options)
            wire = open_wire(options.interface, options.channel)
            stack.callback(wire.close)
            leash = (sys.stdin.fileno(),) if options.leash else ()
            if len(nodes) > 1:
                return host(Loop(Segment(nodes), wire), say, leash)
            loop = Loop(nodes[0], wire)
            keeper = memory.Keeper(nodes[0], options.storage) if options.storage else None
            server = serve(loop, options.control, stack) if options.control else None
            return host(loop, say, leash, server, keeper)
    except (WireError, ValueError, OSError) as error:
        print(f"node_model: {error}", file=sys.stderr)  # noqa: T201 - a command prints
        return 2


def nodes_of(options: argparse.Namespace) -> list[Panel]:
    """The devices that were asked for, switched off."""
    image = memory.read_image(options.storage) if options.storage else None
    return [
        devices.make_device(
            options.profile,
            model=options.mutant,
            node_id=node_id,
            image=image,
            eds=options.eds,
        )
        for node_id in options.node_id or (None,)
    ]


def open_wire(interface: str, channel: str) -> Wire:
    """The wire for an interface type of python-can."""
    if interface == "socketcan":
        return SocketCanWire(channel)
    from node_model.host.pythoncan import PythonCanWire  # noqa: PLC0415 - needs an extra

    return PythonCanWire(interface, channel)


def serve(loop: Loop[Panel], address: str, stack: contextlib.ExitStack) -> Server:
    """A control server for a node."""
    verbs = Verbs(loop)
    server = Server(address, verbs, verbs.release)
    stack.callback(server.close)
    return server


def host(
    loop: Loop[Node],
    say: Callable[[str], None],
    leash: Sequence[int] = (),
    server: Server | None = None,
    keeper: memory.Keeper | None = None,
) -> int:
    """Host what is in a loop until SIGTERM or SIGINT, or the end of what a leash reads."""
    with stop_signal() as stop:
        _prefer_exact_timers()
        gc.collect()
        gc.freeze()
        say(f"ready control={server.address if server else '-'} channel={loop.wire.name}")
        sys.stdout.flush()
        if server is None:
            loop.power(True, loop.instant())
        run(loop, server, (stop.fileno(), *leash), keeper)
    return 0


def run(
    loop: Loop[Node], server: Server | None, stops: Sequence[int], keeper: memory.Keeper | None
) -> None:
    """Turn until something is readable on one of `stops`."""
    wire = loop.wire.descriptor
    while True:
        loop.catch_up()
        if keeper:
            keeper.keep()
        readable, writable = server.descriptors() if server else ([], [])
        fixed = [*stops] if wire is None else [*stops, wire]
        ready, room, _ = select.select([*fixed, *readable], writable, [], _wait_s(loop))
        if any(stop in ready for stop in stops):
            return
        if server and (room or any(fd not in fixed for fd in ready) or _is_done(loop)):
            loop.catch_up()
            server.turn()


def _is_done(loop: Loop[Node]) -> bool:
    """A job came to its end: the client waits for its answer."""
    return loop.job is not None and loop.job.due() is None


def _wait_s(loop: Loop[Node]) -> float:
    """How long nothing is due: sleep to shortly before it, then look without sleeping."""
    due = loop.wake_at()
    left = _LONGEST_NS if due is None else due - loop.clock()
    left = min(left - _SPIN_NS, _LONGEST_NS)
    if left > _LONG_NS:
        left -= left // _SLACK_SHARE
    if _is_done(loop):
        left = 0
    if loop.wire.descriptor is None:
        left = min(left, _NO_DESCRIPTOR_NS)
    return max(left, 0) / S


@contextlib.contextmanager
def stop_signal() -> Iterator[socket.socket]:
    """A socket that becomes readable on SIGTERM or SIGINT."""
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    before = {
        number: signal.signal(number, lambda *_: None)
        for number in (signal.SIGTERM, signal.SIGINT)
    }
    wakeup = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    try:
        yield ours
    finally:
        signal.set_wakeup_fd(wakeup)
        for number, handler in before.items():
            signal.signal(number, handler)
        ours.close()
        theirs.close()


def _prefer_exact_timers() -> None:
    """Linux rounds our wake-ups by 50 us unless asked not to (prctl(2), timer slack)."""
    with contextlib.suppress(OSError):
        Path("/proc/self/timerslack_ns").write_text("1", encoding="ascii")
