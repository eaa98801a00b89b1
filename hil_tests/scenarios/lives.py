"""Every oracle on one life of a device: keys, EMCY, echoes, lights, in order of time."""

from __future__ import annotations

from collections.abc import Iterator

from hil_tests.api import ECHO_PERIOD_NS, KeypadBench, Limits, Outcome, Verdict
from hil_tests.clock import FOREVER
from hil_tests.judge.darkness import judge_darkness
from hil_tests.judge.echoes import EchoRules, Stay, judge_echoes
from hil_tests.judge.glow import judge_glow
from hil_tests.judge.lights import LightRules, judge_lights
from hil_tests.judge.starts import judge_starts
from hil_tests.scenarios.record import Life, glow_rules
from hil_tests.scenarios.story import doubted, judge_key_frames, key_rules


def judge_operation(bench: KeypadBench, life: Life, until: int, *, doubts: bool) -> list[Verdict]:
    """What is wrong in a life of regular operation.

    Args:
        bench: its trace and the facts of the device.
        life: read from the trace.
        until: every frame that was asked for before this is in it.
        doubts: also what is wrong only if every doubt goes against the device.
    """
    profile = bench.profile
    found = judge_key_frames(life, key_rules(bench), until, doubts=doubts)
    found += judge_starts(life.starts, life.emergencies, profile.limits.emcy_ns, until)
    rules = LightRules(profile.led_bits, profile.led_frame_bytes, profile.both_set == "steady")
    found += judge_lights(life.lights, rules)
    for watched in life.watched:
        found += judge_glow(watched, glow_rules(bench))
    return in_order(doubted(found, life))


def judge_commissioning(
    bench: KeypadBench, life: Life, ready_at: int, until: int
) -> list[Verdict]:
    """What is wrong in a stay in commissioning.

    Args:
        bench: the facts of the device.
        life: read from the trace.
        ready_at: from here on the device waits for sure.
        until: every frame that was asked for before this is in it.
    """
    stay = Stay(ready_at, life.requests, life.echoes, until)
    limits = bench.profile.limits
    each, mean = limits.echo_each(ECHO_PERIOD_NS), limits.echo_mean(ECHO_PERIOD_NS)
    rules = EchoRules(Limits(*each), Limits(*mean))
    found = [*judge_echoes(stay, rules)]
    found += judge_darkness(life.looks, stay, bench.profile.led_bits)
    return in_order(doubted(found, life))


def in_order(found: list[Verdict]) -> list[Verdict]:
    """By time: what is wrong first is the cause of what follows."""
    return sorted(found, key=lambda verdict: FOREVER if verdict.at is None else verdict.at)


def failures(found: list[Verdict]) -> Iterator[Verdict]:
    """Those that are certain."""
    return (verdict for verdict in found if verdict.outcome is Outcome.FAIL)
