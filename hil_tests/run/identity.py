"""Who is under test: what the device says of itself, what its EDS says, and what people say.

The device is asked before the first test, where its profile names an EDS: that says that it
has an object dictionary to read. The frames of that are recorded, `traces/identity-....pcapng`;
tests and monitors see nothing of them. A replay asks that recording.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil_tests.bench.identity import Told, ask
from hil_tests.errors import BenchError, ConfigError
from hil_tests.replay.runs import IDENTITY
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.rundir import RunDirectory
from hil_tests.trace import Moment

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.run.plan import Plan

_EDS_SAYS = ("vendor", "product", "revision")
_BY_HAND = "operator"
_NUMBER = re.compile(
    r"(?:0x)?(?P<digits>[0-9]+|(?<=0x)[0-9a-f]+|[0-9a-f]+(?=h$)|[0-9a-f]{8})h?", re.IGNORECASE
)
_SERIAL, _SOFTWARE = "1018h:04", "100Ah"


@dataclass(frozen=True, slots=True)
class Identity:
    """Who is under test, as results.json has it.

    Args:
        serial: number or text; None = nobody knows.
        serial_from: who says so: an option's source, "bench file", "recording", "1018h:04".
        firmware: version.
        firmware_from: the same, or "100Ah".
        facts: the table `identity`.
    """

    serial: str | None
    serial_from: str | None
    firmware: str | None
    firmware_from: str | None
    facts: Mapping[str, Any]

    @property
    def line(self) -> str:
        """For the head of a run; "" = there is nothing to say."""
        facts = self.facts
        if not facts:
            return ""
        told = [str(facts[name]) for name in ("vendor_name", "product_name") if facts.get(name)]
        told += [f"{name} {facts[name]:08X}h" for name in _EDS_SAYS if name in facts]
        told += [f"serial {self.serial} ({self.serial_from})"] if self.serial else []
        told += [f"firmware {self.firmware} ({self.firmware_from})"] if self.firmware else []
        source = facts["from"]
        why = f"; not read from the device: {facts['not_read']}" if facts["not_read"] else ""
        return f"identity: {', '.join(told) or 'unknown'}; from the {source}{why}"

    @property
    def warnings(self) -> list[str]:
        """What does not fit together, a sentence each."""
        return list(self.facts.get("differs", ()))


# Asking the device.


def read_device(plan: Plan, bench: Bench, folder: RunDirectory) -> tuple[Told, str | None]:
    """Ask the device on a bench; what it told, and where that is recorded.

    Args:
        plan: of the run.
        bench: open; a test that begins on it begins anew.
        folder: of the run.
    """
    path = folder.trace_path(IDENTITY)
    try:
        told = (
            _ask_recorded(plan, bench, path)
            if _claim(path)
            else ask(bench, switch=_by_itself(plan))
        )
    except BenchError as error:
        return Told(not_read=str(error)), None
    bench.begin()
    return told, folder.relative(path)


def _claim(path: Path) -> bool:
    """Whether this process records it: where tests are spread, every worker asks the same."""
    try:
        path.open("xb").close()
    except FileExistsError:
        return False
    except OSError:
        return True  # who opens it to write says what is wrong
    return True


def _ask_recorded(plan: Plan, bench: Bench, path: Path) -> Told:
    port, switch = bench.stage.port, _by_itself(plan)
    with PcapngSink(path, interface=port.name, clock=port.clock, flush=not plan.virtual) as sink:
        bench.begin(sink)
        sink.write(_opening(bench.opening, plan))
        told = ask(bench, switch=switch)
        now = bench.now()
        sink.write(Moment("end", now, now, {"outcome": IDENTITY, "text": told.not_read}))
    return told


def _opening(opening: Moment, plan: Plan) -> Moment:
    told = {"test": IDENTITY, "requirements": [], "settings": plan.told}
    detail = {**opening.detail, **told, "switches": _by_itself(plan)}
    return Moment("begin", opening.began_at, opening.ended_at, detail)


def _by_itself(plan: Plan) -> bool:
    """Whether the supply can be switched without a person."""
    if plan.recording is not None:
        record = plan.recording.identity
        return record is not None and record.opening.detail.get("switches") is True
    section = plan.bench_file.power if plan.bench_file else None
    return section is None or section.driver != _BY_HAND


# What is known altogether.


def identify(plan: Plan, told: Told | None, record: str | None) -> Identity:
    """Everything that is known of the device.

    Args:
        plan: of the run: its EDS, and what people say.
        told: what the device said; None = it was not asked.
        record: where that is recorded.
    """
    sheet = plan.profile.eds
    if sheet is None:
        return Identity(*_known(plan, "serial", {}), *_known(plan, "firmware", {}), {})
    written = identity_of(sheet)
    told = told or Told(not_read="there is no bench to ask it on")
    numbers = told.numbers
    serial = {_SERIAL: str(numbers["serial"])} if numbers.get("serial") else {}
    software = {_SOFTWARE: told.texts["software"]} if told.texts.get("software") else {}
    facts = {
        **written,
        **numbers,
        **told.texts,
        "from": "device" if numbers else "EDS" if written else "profile",
        "not_read": told.not_read,
        "differs": list(_differences(plan, told, written)),
        "trace": record,
    }
    return Identity(*_known(plan, "serial", serial), *_known(plan, "firmware", software), facts)


def _said(plan: Plan, name: str) -> tuple[str | None, str | None]:
    """What people say of the device, and where."""
    key = f"can_{name}"
    if plan.settings[key]:
        return str(plan.settings[key]), plan.settings.origins[key]
    known = getattr(plan.bench_file.device, name) if plan.bench_file else None
    return (known, "bench file") if known else (None, None)


def _known(plan: Plan, name: str, told: Mapping[str, str]) -> tuple[str | None, str | None]:
    """What people say comes before what the device says."""
    said = _said(plan, name)
    if said[0] or not told:
        return said
    ((source, value),) = told.items()
    return value, source


def _differences(plan: Plan, told: Told, written: Mapping[str, Any]) -> Iterator[str]:
    for name in _EDS_SAYS:
        there, here = told.numbers.get(name), written.get(name)
        if there is not None and here and there != here:
            yield f"{name}: the device says {there:08X}h, and its EDS {here:08X}h"
    number, (said, source) = told.numbers.get("serial"), _said(plan, "serial")
    meant = _numbers_in(said or "")
    if number and meant and number not in meant:
        yield (
            f"serial number: the device says {number} ({number:08X}h in {_SERIAL}), and the"
            f" {source} {said}"
        )
    software, (version, source) = told.texts.get("software"), _said(plan, "firmware")
    if software and version is not None and software != version:
        yield f"firmware: the device says {software} ({_SOFTWARE}), and the {source} {version}"


def _numbers_in(text: str) -> set[int]:
    """The numbers that a label can stand for, decimal or hexadecimal; none = it is a name."""
    found = _NUMBER.fullmatch(text.strip())
    if found is None:
        return set()
    digits = found["digits"]
    return {int(digits, 16)} | ({int(digits)} if digits.isdecimal() else set())


def identity_of(sheet: str | Path) -> dict[str, Any]:
    """What an electronic data sheet says of the device as a whole; {} = it cannot be read.

    Args:
        sheet: path of the EDS file.
    """
    from hil_tests.eds import read_sheet  # noqa: PLC0415 - where a device has one

    try:
        device = read_sheet(sheet).device
    except (OSError, ConfigError):
        return {}
    told = {
        "vendor_name": device.vendor_name,
        "product_name": device.product_name,
        "vendor": device.vendor,
        "product": device.product,
        "revision": device.revision,
    }
    return {name: value for name, value in told.items() if value not in {None, ""}}
