"""Do Wireshark's tshark and our decoder say the same of every frame of our traces?

    python -m tests.reporting.agreement reports/latest

holds a whole run against tshark: COB function, node, NMT command and state, SYNC counter, EMCY
code, SDO command, object and abort code, LSS service. What is malformed to tshark must be odd to
our decoder as well. Known differences stand in tshark.toml with their reasons.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from hil_tests.decode import decode
from hil_tests.decode_facts import ERROR_CONTROL, UNKNOWN, Facts, facts
from hil_tests.decode_sdo import SdoFrame
from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.trace import Sighting
from node_model.frame import Frame

NUMBERS = {
    "node": "canopen.node_id",
    "command": "canopen.nmt_ctrl.cd",
    "target": "canopen.nmt_ctrl.node_id",
    "state": "canopen.nmt_guard.state",
    "code": "canopen.em.err_code",
    "register": "canopen.em.err_reg",
    "counter": "canopen.sync.counter",
    "service": "canopen.lss.cs",
    "index": "canopen.sdo.main_idx",
    "sub": "canopen.sdo.sub_idx",
    "abort": "canopen.sdo.abort_code",
}
"""What is compared -> the field of tshark."""

TOGGLES = ("canopen.nmt_guard.toggle", "canopen.sdo.toggle")
IDENTITY = ("can.id", "can.flags.rtr", "can.flags.xtd")
TEXTS = ("_ws.malformed", "_ws.col.Info")
ASKED = (*IDENTITY, *NUMBERS.values(), *TOGGLES, *TEXTS)

FUNCTIONS = {
    "NMT": "NMT",
    "SYNC": "SYNC",
    "TIME STAMP": "TIME",
    "EMCY": "EMCY",
    "NMT Error Control": ERROR_CONTROL,
    "Default-SDO (rx)": "SDO request",
    "Default-SDO (tx)": "SDO answer",
    "LSS (Master)": "LSS request",
    "LSS (Slave)": "LSS answer",
    **{f"PDO{number} (tx)": f"TPDO{number}" for number in range(1, 5)},
    **{f"PDO{number} (rx)": f"RPDO{number}" for number in range(1, 5)},
}
"""tshark's names -> ours; it says "Unknown" of the others."""

COMMANDS = {
    ("segment", "SDO request"): "Download segment request",
    ("write", "SDO request"): "Initiate download request",
    ("read", "SDO request"): "Initiate upload request",
    ("next segment", "SDO request"): "Upload segment request",
    ("segment", "SDO answer"): "Upload segment response",
    ("segment written", "SDO answer"): "Download segment response",
    ("value of", "SDO answer"): "Initiate upload response",
    ("written", "SDO answer"): "Initiate download response",
}
"""SDO commands in our words, and in tshark's; the others are the same both ways."""

BOTH_WAYS = {
    "abort": "Abort transfer",
    "block read": "Block upload",
    "block write": "Block download",
}


@dataclass(frozen=True)
class Known:
    """A known difference.

    Args:
        frames: which frames it is about, see `PREDICATES`.
        but: what is not compared there.
        why: the reason.
    """

    frames: str
    but: frozenset[str]
    why: str


PREDICATES: Mapping[str, Callable[[Frame, Facts], bool]] = {
    "remote": lambda frame, _: frame.remote,
    "no function": lambda _, ours: ours.function == UNKNOWN,
    "odd SYNC": lambda frame, ours: ours.function == "SYNC" and len(frame.data) > 1,
    "short SDO": lambda frame, ours: ours.function.startswith("SDO") and len(frame.data) < 4,
    "block begun with more than a size": lambda frame, ours: (
        ours.sdo is not None and ours.sdo.step == "begin" and bool(frame.data[0] & 0b11101)
    ),
    "block of no step": lambda frame, ours: (
        ours.function == "SDO answer" and len(frame.data) > 3 and frame.data[0] & 0xE3 == 0xA3
    ),
    "odd error control": lambda frame, ours: (
        ours.function == ERROR_CONTROL and len(frame.data) > 1
    ),
}


def known_differences() -> dict[str, Known]:
    """Those of tshark.toml, by name."""
    document = tomllib.loads(Path(__file__).with_name("tshark.toml").read_text("utf-8"))
    return {
        name: Known(each["frames"], frozenset(each["but"]), each["why"])
        for name, each in document.items()
    }


def dissected(paths: Iterable[Path]) -> Iterator[dict[str, str]]:
    """What tshark says of each frame of some traces: a pcapng may have many sections."""
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "all.pcapng"
        with whole.open("wb") as file:
            for path in paths:
                file.write(path.read_bytes())
        wanted = [word for name in ASKED for word in ("-e", name)]
        command = ["tshark", "-r", str(whole), "-d", "can.subdissector,canopen", "-Y", "can"]
        done = subprocess.run(
            [*command, "-T", "fields", "-E", "occurrence=f", *wanted],
            check=True,
            capture_output=True,
            text=True,
        )
    for line in done.stdout.splitlines():
        yield dict(zip(ASKED, line.split("\t"), strict=True))


def frames_of(path: Path) -> Iterator[Frame]:
    """The frames of a trace, as our reader gives them back."""
    return (entry.frame for entry in read_pcapng(path) if isinstance(entry, Sighting))


class Agreement:
    """Compares frame by frame, and counts.

    Args:
        known: differences that are right.
    """

    def __init__(self, known: Mapping[str, Known]) -> None:
        self.known = known
        self.frames = 0
        self.used: Counter[str] = Counter()
        self.malformed: Counter[str] = Counter()
        """Text of our decoder for frames that are malformed to tshark."""

    def compare(self, frame: Frame, told: Mapping[str, str]) -> list[str]:
        """Where the two differ on a frame, one sentence each."""
        self.frames += 1
        ours = facts(frame)
        text = decode(frame, None, "")
        if told["_ws.malformed"]:
            self.malformed[text] += 1
            odd = "instead of" in text or ours.function == UNKNOWN
            return [] if odd else [f"{frame}: malformed to tshark, and to us {text}"]
        mine = _ours(frame, ours)
        wrong = {
            name: (mine[name], theirs)
            for name, theirs in _theirs(told, ours).items()
            if theirs != mine[name]
        }
        for name, known in self.known.items():
            if PREDICATES[known.frames](frame, ours):
                excused = known.but & set(wrong)
                self.used[name] += bool(excused)
                wrong = {key: pair for key, pair in wrong.items() if key not in excused}
        return [
            f"{frame} ({text}): {name} {ours_} to us, {theirs} to tshark"
            for name, (ours_, theirs) in wrong.items()
        ]


def _ours(frame: Frame, ours: Facts) -> dict[str, object]:
    sdo = ours.sdo or SdoFrame("")
    return {
        "identifier": (frame.can_id, frame.remote, frame.extended),
        "function": ours.function,
        "sdo": _command(ours) if ours.sdo else None,
        "node": ours.node,
        "command": ours.command,
        "target": ours.target,
        "state": ours.state,
        "toggle": ours.toggle,
        "code": ours.code,
        "register": ours.register,
        "counter": ours.counter,
        "service": ours.service,
        "index": sdo.index,
        "sub": sdo.sub,
        "abort": sdo.abort,
    }


def _command(ours: Facts) -> str:
    assert ours.sdo is not None
    word = ours.sdo.command
    return COMMANDS.get((word, ours.function)) or BOTH_WAYS.get(word, "Unknown")


def _theirs(told: Mapping[str, str], ours: Facts) -> dict[str, object]:
    info = told["_ws.col.Info"]
    head, _, rest = info.partition(": ")
    function = FUNCTIONS.get(head.partition(" [")[0], UNKNOWN)
    flags = (told["can.flags.rtr"], told["can.flags.xtd"])
    numbers = {name: _number(told[field]) for name, field in NUMBERS.items()}
    if ours.node is None and function not in {"EMCY", ERROR_CONTROL}:
        # Services without a node: tshark splits their identifiers all the same.
        numbers["node"] = None
    is_sdo = head.startswith("Default-SDO")
    toggles = [_number(told[field]) for field in TOGGLES if told[field]]
    return {
        "identifier": (int(told["can.id"], 0), *(each in {"1", "True"} for each in flags)),
        "function": function,
        "sdo": ("Unknown" if rest.startswith("Unknown") else rest) if is_sdo else None,
        "toggle": toggles[0] if toggles else None,
        **numbers,
    }


def _number(text: str) -> int | None:
    return int(text, 0) if text else None


def compare_all(paths: list[Path], agreement: Agreement) -> list[str]:
    """Where the two differ on some traces; the name of the trace before each sentence."""
    wrong: list[str] = []
    theirs = dissected(paths)
    for path in paths:
        for frame in frames_of(path):
            told = next(theirs, None)
            if told is None:
                return [*wrong, f"{path.name}: tshark sees no more frames at {frame}"]
            wrong += [f"{path.name}: {line}" for line in agreement.compare(frame, told)]
    extra = sum(1 for _ in theirs)
    return [*wrong, f"tshark sees {extra} frames more than we"] if extra else wrong


def main(words: list[str]) -> int:
    """Hold the traces of a run against tshark; 0 = both agree on every frame."""
    say = sys.stdout.write
    if len(words) != 1 or not (Path(words[0]) / "traces").is_dir():
        say("usage: python -m tests.reporting.agreement RUN\n")
        return 2
    if not shutil.which("tshark"):
        say("tshark is not installed\n")
        return 2
    traces = sorted((Path(words[0]) / "traces").glob("*.pcapng"))
    agreement = Agreement(known_differences())
    wrong = compare_all(traces, agreement)
    say("".join(f"{line}\n" for line in wrong[:100]))
    say(
        f"{len(traces)} traces, {agreement.frames} frames, {len(wrong)} differences;"
        f" malformed to tshark and odd to us: {agreement.malformed.total()};"
        f" known differences: {dict(agreement.used)}\n"
    )
    return 1 if wrong or not agreement.frames else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
