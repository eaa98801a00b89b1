"""What will be tested, and on what: decided before any bus is touched."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from hil_tests.clock import FOREVER, parse_span
from hil_tests.config import (
    BenchFile,
    Cia301Parameters,
    Cia301Profile,
    DeviceProfile,
    Parameters,
    Setup,
    load_bench,
    load_profile,
)
from hil_tests.errors import ConfigError
from hil_tests.requirements import FACILITIES, Requirement, load, load_with_sheet

if TYPE_CHECKING:
    from hil_tests.replay.runs import RecordedRun
    from hil_tests.run.options import Settings

VIRTUAL = "virtual"
MODEL = "model"
EXTERNAL = "external"
_MODEL_CHANNELS = ("vcan", "vxcan")
_MODEL_INTERFACES = ("virtual", "udp_multicast")


_TOLD = ("can_profile", "can_mutant", "can_seed", "can_strict")
BUDGET = "10min"
"""Time for stored scenarios on a real bench, where nobody says."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything about a run that is known from options and files alone.

    Args:
        device: "virtual" (model in virtual time), "model" (hosted), or "external".
        why: how that was decided.
        interface: python-can's word, or "virtual time".
        channel: on it.
        bit_rate: to set or assume; None = the device's own.
        exclusive: nothing else lives on the bus.
        timed: whether the wire arbitrates and has bit times, as far as can be told.
        profile: of the device.
        home: what the device is set to; None = not known.
        facilities: that the bench has.
        bench_name: for people.
        bench_file: as read, or None.
        mutant: name of the model's fault, or None.
        requirements: of its kind, and those of `by_sheet`.
        settings: the options.
        by_sheet: what is asked of it only because its data sheet is known.
        recording: the run that is replayed, or None.
    """

    device: str
    why: str
    interface: str
    channel: str
    bit_rate: int | None
    exclusive: bool
    timed: bool
    profile: DeviceProfile
    home: Setup | None
    facilities: tuple[str, ...]
    bench_name: str
    bench_file: BenchFile | None
    mutant: str | None
    requirements: Mapping[str, Requirement]
    settings: Settings
    by_sheet: frozenset[str] = frozenset()
    recording: RecordedRun | None = None

    @property
    def virtual(self) -> bool:
        """The run is in virtual time."""
        return self.device == VIRTUAL

    @property
    def is_external(self) -> bool:
        """The device is the user's own."""
        return self.device == EXTERNAL

    @property
    def told(self) -> dict[str, object]:
        """Settings that a verdict depends on besides the record; every record has them."""
        return {key: self.settings[key] for key in _TOLD}

    @property
    def budget_ns(self) -> int:
        """Time for stored scenarios; in virtual time they cost none.

        Those of the command line were asked for by name: no default keeps them from being played.
        """
        named = self.settings["can_scenario"] and not self.settings["can_budget"]
        if self.virtual or named:
            return FOREVER
        return parse_span(self.settings["can_budget"] or BUDGET)

    @property
    def writes_allowed(self) -> bool:
        """Non-volatile memory of the device may be written."""
        return not self.is_external or bool(self.settings["can_allow_writes"])


def make_plan(settings: Settings) -> Plan:
    """Decide what will be tested, and on what.

    Raises:
        ConfigError: options or files that are wrong or do not go together.
    """
    if settings["can_replay"]:
        from hil_tests.run.replaying import plan_of_recording  # noqa: PLC0415 - only there

        return plan_of_recording(settings)
    bench, profile = _files(settings)
    channel = settings["can_iface"] or (bench.bus.channel if bench else None)
    interface = settings["can_interface"] or (bench.bus.interface if bench else None)
    device, why = _who(settings, bench, channel, interface)
    _check(settings, bench, profile, device, channel, interface)
    real = device != VIRTUAL
    if real:
        settings = _of_today(settings)
    profile = _with_eds(profile, settings["can_eds"])
    requirements, by_sheet = asked_of(profile)
    return Plan(
        device=device,
        why=why,
        interface=(interface or "socketcan") if real else "virtual time",
        channel=channel or "-",
        bit_rate=settings["can_bitrate"] or (bench.bus.bitrate if bench else None),
        exclusive=device != EXTERNAL or (bench is not None and bench.bus.exclusive),
        timed=not real or _timed(channel or "", interface or "socketcan"),
        profile=profile,
        home=_home(settings, bench, profile, device),
        facilities=_facilities(device, bench, profile),
        bench_name=_bench_name(bench, device),
        bench_file=bench,
        mutant=settings["can_mutant"],
        requirements=requirements,
        settings=settings,
        by_sheet=by_sheet,
    )


def _of_today(settings: Settings) -> Settings:
    """A real bench draws other values each day, unless a seed is given: its number is the date."""
    if settings.origins["can_seed"] != "default":
        return settings
    seed = int(datetime.now(UTC).strftime("%Y%m%d"))
    origins = {**settings.origins, "can_seed": "date"}
    return replace(settings, values={**settings.values, "can_seed": seed}, origins=origins)


def _with_eds(profile: DeviceProfile, path: str | None) -> DeviceProfile:
    """The profile with the electronic data sheet of the command line, where there is one."""
    return attrs.evolve(profile, eds=path) if path else profile


def asked_of(profile: DeviceProfile) -> tuple[Mapping[str, Requirement], frozenset[str]]:
    """Everything that a device of this profile is judged by, and what of it by its data sheet."""
    besides = load_with_sheet(profile.kind) if profile.eds else {}
    return {**load(profile.kind), **besides}, frozenset(besides)


def _files(settings: Settings) -> tuple[BenchFile | None, DeviceProfile]:
    """Bench file and profile; what is wrong with both is told at once."""
    wrong = []
    bench: BenchFile | None = None
    if settings["can_bench"]:
        try:
            bench = load_bench(settings["can_bench"])
        except ConfigError as error:
            wrong.append(str(error))
    try:
        profile = load_profile(_profile_name(settings, bench))
    except ConfigError as error:
        raise ConfigError("\n".join([*wrong, str(error)])) from None
    if wrong:
        raise ConfigError("\n".join(wrong))
    return bench, profile


def _profile_name(settings: Settings, bench: BenchFile | None) -> str:
    """Command line, environment and ini before the bench file, that before the default."""
    named = bench.device.profile if bench else None
    if named and settings.origins["can_profile"] == "default":
        return named
    return str(settings["can_profile"])


def _who(
    settings: Settings, bench: BenchFile | None, channel: str | None, interface: str | None
) -> tuple[str, str]:
    chosen = settings["can_device"]
    if not channel:
        # A model in virtual time in place of the user's device would be a false PASS.
        meant = {
            f"--can-device {chosen}": chosen == EXTERNAL,
            f"--can-interface {interface}": interface,
            f"--can-bench {settings['can_bench']}": settings["can_bench"],
        }
        for option, given in meant.items():
            if given:
                raise ConfigError(
                    f"{option}: on which bus? add --can-iface NAME, or [bus] channel to the bench"
                    " file"
                )
        return VIRTUAL, "no --can-iface given"
    if chosen:
        return chosen, settings.origins["can_device"]
    if bench is not None and bench.facilities:
        return EXTERNAL, "the bench file says how it is worked"
    if channel.startswith(_MODEL_CHANNELS) or interface in _MODEL_INTERFACES:
        return MODEL, f"default on {channel}"
    return EXTERNAL, f"default on {channel}"


def _check(
    settings: Settings,
    bench: BenchFile | None,
    profile: DeviceProfile,
    device: str,
    channel: str | None,
    interface: str | None,
) -> None:
    """Whatever does not go together, all at once."""
    wrong = [*_eds_problems(settings, profile), *_strange_parameters(bench, profile)]
    if settings["can_report_pdf"]:
        from hil_tests.reporting.html import why_not  # noqa: PLC0415 - jinja2, when needed

        wrong += [f"--can-report-pdf: {problem}" for problem in (why_not(),) if problem]
    if device == MODEL and interface == "virtual":
        wrong.append(
            "--can-interface virtual ends at its own process, where no model is hosted; use"
            " udp_multicast, vcan, or virtual time (without --can-iface)"
        )
    if settings["can_mutant"]:
        wrong += unknown_mutant(settings["can_mutant"], profile.kind)
    if settings["can_mutant"] and device == EXTERNAL:
        wrong.append(
            f"--can-mutant {settings['can_mutant']} is a model, and the device on {channel} is"
            " external; add --can-device model, or host it yourself: python -m node_model"
        )
    node_id = settings["can_node_id"] or (bench.device.node_id if bench else None)
    if node_id is not None and node_id not in profile.node_ids:
        ids = profile.node_ids
        wrong.append(f"node id {node_id}: a {profile.name} has one of {ids[0]} .. {ids[-1]}")
    wrong += _unknown_budget(settings["can_budget"])
    wrong += _no_scenarios(settings["can_scenario"])
    if wrong:
        raise ConfigError("\n".join(wrong))


def _eds_problems(settings: Settings, profile: DeviceProfile) -> list[str]:
    """What is wrong with the electronic data sheet, or that there is none."""
    given = settings["can_eds"]
    if given and not Path(given).is_file():
        return [f"--can-eds {given}: no such file"]
    if not given and profile.kind == "generic" and profile.eds is None:
        return ["the profile describes any device; say which with --can-eds FILE"]
    return []


def _strange_parameters(bench: BenchFile | None, profile: DeviceProfile) -> list[str]:
    """Parameters in a bench file that only a keypad has."""
    known = bench.device.parameters if bench else None
    if bench is None or known is None or profile.kind == "keypad":
        return []
    names = ", ".join(known.strange_to_cia301())
    text = f"{bench.path}: device.parameters: a {profile.kind} has heartbeat_ms alone; remove"
    return [f"{text} {names}"] if names else []


def _unknown_budget(text: str | None) -> list[str]:
    """What is wrong with a time for stored scenarios."""
    try:
        parse_span(text or BUDGET)
    except ValueError as error:
        return [f"--can-budget {error}"]
    return []


def _no_scenarios(texts: Sequence[str]) -> list[str]:
    """What is wrong with scenarios of the command line."""
    from hil_tests.scenarios.scenario import scenario  # noqa: PLC0415 - only where one is given

    wrong = []
    for text in texts:
        try:
            scenario(text)
        except ValueError as error:
            wrong.append(f"--can-scenario: {error}")
    return wrong


def unknown_mutant(name: str, kind: str) -> list[str]:
    """What is wrong with the name of a mutant or variant, and what may have been meant."""
    from node_model.faults import MODELS, mutants_of, variants_of  # noqa: PLC0415 - where named

    known = [*mutants_of(kind), *variants_of(kind)]
    if name in known:
        return []
    if name in MODELS:
        other = MODELS[name].kind
        return [f"--can-mutant {name} is a {other}, and the profile is of a {kind}"]
    close = difflib.get_close_matches(name.lower()[:64], known, 3)
    hint = f"did you mean {', '.join(close)}? " if close else ""
    return [f"--can-mutant {name[:64]}: no such model; {hint}--can-mutant list names them all"]


def _home(
    settings: Settings, bench: BenchFile | None, profile: DeviceProfile, device: str
) -> Setup | None:
    """What the device is set to, as far as anybody says."""
    node_id = settings["can_node_id"]
    if isinstance(profile, Cia301Profile):
        return _cia301_home(settings, bench, profile)
    if device != EXTERNAL:
        factory = profile.factory
        assert isinstance(factory, Parameters)
        return attrs.evolve(factory, node_id=node_id) if node_id else factory
    known = bench.device.parameters if bench else None
    if known is None or bench is None:
        return None
    return known.complete(node_id or bench.device.node_id)


def _cia301_home(
    settings: Settings, bench: BenchFile | None, profile: Cia301Profile
) -> Cia301Parameters:
    """Its factory settings, but for what options and bench file say."""
    said = {
        "node_id": settings["can_node_id"] or (bench.device.node_id if bench else None),
        "bit_rate": settings["can_bitrate"] or (bench.bus.bitrate if bench else None),
        "heartbeat_ms": bench.device.parameters.heartbeat_ms
        if bench and bench.device.parameters
        else None,
    }
    known = {name: value for name, value in said.items() if value is not None}
    return attrs.evolve(profile.factory, **known)


def _facilities(device: str, bench: BenchFile | None, profile: DeviceProfile) -> tuple[str, ...]:
    """A model has all of its kind; an external device has those of its bench file."""
    has = {"keys": profile.key_bits, "leds": profile.led_bits, "faults": profile.faults}
    of_kind = tuple(name for name in FACILITIES if name not in has or has[name])
    if device != EXTERNAL:
        return of_kind
    there = bench.facilities if bench else ()
    return tuple(name for name in there if name in of_kind)


def _bench_name(bench: BenchFile | None, device: str) -> str:
    if bench is not None:
        return bench.name
    return {VIRTUAL: "virtual", MODEL: "hosted model", EXTERNAL: "no bench file"}[device]


def _timed(channel: str, interface: str) -> bool:
    untimed = channel.startswith(_MODEL_CHANNELS) or interface in _MODEL_INTERFACES
    return not untimed
