"""Layer setting services of a device (CiA 305 3.0.0)."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_tests.acceptance.cia301.lss_steps import (
    another_id,
    expect_boot_up,
    give_node_id,
    known,
    may_configure,
)
from hil_tests.acceptance.cia301.steps import DEVICE_TYPE, go, reset
from hil_tests.acceptance.nmt_steps import RUNNING_STATES, name_of
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    Identity,
    Lss,
    Nmt,
    NotApplicable,
    Power,
    S,
    Sdo,
    Sheet,
    State,
    matchers,
    nmt_frame,
    sdo_frames,
)
from hil_tests.api import (
    lss as services,
)


@pytest.mark.requirement("C-LS-01")
def test_switch_global_is_not_answered(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """Neither into configuration nor out of it."""
    known(bench, sdo, sheet)
    lss.silence(services.switch_global(services.CONFIGURATION))
    lss.silence(services.switch_global(services.WAITING))


@pytest.mark.requirement("C-LS-01")
def test_requests_of_other_lengths_are_not_answered(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """An inquiry of two and of seven bytes; one of eight is."""
    known(bench, sdo, sheet)
    lss.configure()
    for length in (0, 2, 7):
        short = Frame(services.REQUEST_ID, services.inquire(0).data[:length])
        lss.silence(short)
    lss.inquire(0)
    lss.leave()


@pytest.mark.requirement("C-LS-02")
def test_the_node_with_its_identity_is_selected(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """All four numbers equal: it says so, and is in configuration."""
    identity = known(bench, sdo, sheet)
    lss.silence(services.inquire(4))
    lss.select(identity)
    lss.inquire(4)
    lss.leave()
    lss.silence(services.inquire(4))


@pytest.mark.requirement("C-LS-02")
@pytest.mark.parametrize("part", ["vendor", "product", "revision", "serial"])
def test_a_node_of_another_identity_is_silent(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss, part: str
) -> None:
    """One number that differs in one bit."""
    identity = known(bench, sdo, sheet)
    other = replace(identity, **{part: getattr(identity, part) ^ 1})
    lss.silence(*services.select(other))
    lss.silence(services.inquire(4))


@pytest.mark.requirement("C-LS-07")
def test_inquiries_tell_the_identity_and_the_node_id(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """As 1018h and the node id are."""
    identity = known(bench, sdo, sheet)
    lss.configure()
    found = Identity(*(lss.inquire(part) for part in range(4)))
    bench.check(found == identity, f"the identity is {identity}; it is {found}")
    node_id = lss.inquire(4)
    bench.check(node_id == bench.node_id, f"the node id is {bench.node_id}; it is {node_id}")
    lss.leave()


@pytest.mark.requirement("C-LS-03")
def test_node_ids_are_taken_or_refused(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """1, 127 and 255 are node ids; 0, 128 and 254 are none."""
    known(bench, sdo, sheet)
    may_configure(bench)
    lss.configure()
    for node_id, wanted in ((1, 0), (127, 0), (255, 0), (0, 1), (128, 1), (254, 1)):
        found = lss.set_node_id(node_id)
        text = f"node id {node_id} is answered with {wanted}; it was {found}"
        bench.check(found == wanted, text)
    lss.set_node_id(bench.node_id)
    lss.leave()


def renamed(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss) -> tuple[int, int]:
    """The device in configuration and given another node id: the one it has, and the new one."""
    known(bench, sdo, sheet)
    may_configure(bench)
    new = another_id(bench)
    lss.configure()
    lss.set_node_id(new)
    return bench.node_id, new


@pytest.mark.requirement("C-LS-10", "C-LS-03", "C-LS-07")
def test_a_new_node_id_acts_at_reset_communication(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """Until then the old one counts; then the boot-up has the new one. It is put back."""
    old, new = renamed(bench, sdo, sheet, lss)
    told = lss.inquire(4)
    text = f"the node id is {old} until then; it is {told}"
    bench.check(told == old, text, requirement="C-LS-07")
    lss.leave()
    sdo.read(DEVICE_TYPE, requirement="C-LS-10")
    bench.tolerate_missing_boot_up()
    expect_boot_up(bench, old, new)
    give_node_id(lss, old)
    expect_boot_up(bench, new, old)


@pytest.mark.requirement("C-LS-04")
def test_bit_rates_of_the_data_sheet_are_taken(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """Those of table 0 that it lists; index 5, 10 and 255 are refused, and table 1 is."""
    known(bench, sdo, sheet)
    may_configure(bench)
    lss.configure()
    for rate, index in services.BIT_RATES.items():
        wanted = 0 if rate in sheet.device.bit_rates else 1
        found = lss.set_bit_timing(index)
        text = f"bit rate {rate} (index {index}) is answered with {wanted}; it was {found}"
        bench.check(found == wanted, text)
    for index in (5, 10, 255):
        found = lss.set_bit_timing(index)
        bench.check(found == 1, f"index {index} is answered with 1; it was {found}")
    known_index = services.BIT_RATES[bench.stage.bit_rate]
    found = lss.set_bit_timing(known_index, table=1)
    text = f"table 1, which is reserved, is answered with 1; it was {found}"
    bench.check(found == 1, text)
    lss.set_bit_timing(known_index)
    lss.leave()


@pytest.mark.requirement("C-LS-06")
def test_storing_is_answered(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss) -> None:
    """0 done or 1 not supported; what is stored is what the device had."""
    known(bench, sdo, sheet)
    may_configure(bench)
    lss.configure()
    lss.set_node_id(bench.node_id)
    found = lss.store()
    bench.check(found in {0, 1}, f"storing is answered with 0 or 1; it was {found}")
    bench.characteristic("C-LS-06", f"store configuration is answered with {found}")
    lss.leave()
    reset(bench)


@pytest.mark.requirement("C-LS-06")
def test_a_stored_node_id_survives_without_supply(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss, power: Power
) -> None:
    """The supply is cut and comes back: the boot-up has the stored node id. It is put back."""
    old, new = renamed(bench, sdo, sheet, lss)
    if lss.store():
        lss.set_node_id(old)
        lss.leave()
        raise NotApplicable("the device stores no node id over LSS")
    lss.leave()
    bench.tolerate_missing_boot_up()
    power.off()
    on = power.on()
    within = bench.profile.limits.boot_up_ns
    bench.expect(matchers.boot_up(new), after=on, within=within, requirement="C-LS-06")
    lss.configure()
    lss.set_node_id(old)
    lss.store()
    lss.leave()
    expect_boot_up(bench, new, old)


def lose_node_id(bench: Cia301Bench, lss: Lss) -> None:
    """The device gives up its node id; no monitor judges it from here on."""
    lss.configure()
    lss.set_node_id(services.UNCONFIGURED)
    lss.leave()
    bench.tolerate_missing_boot_up()
    sent = bench.send(nmt_frame(Nmt.RESET_COMMUNICATION, bench.node_id))
    bench.wait(bench.profile.limits.boot_up_ns)
    frames = bench.collect(matchers.anything(), after=sent, until=bench.now())
    boots = [str(seen.frame) for seen in frames if seen.frame.data == b"\x00"]
    text = f"no boot-up comes without a node id; there was {boots}"
    bench.check(not boots, text, requirement="C-LS-08", since=sent)


def regain_node_id(bench: Cia301Bench, lss: Lss) -> None:
    """A node that is in configuration gets the node id that it had, and boots."""
    lss.set_node_id(bench.node_id)
    bench.expect_boot_up(lss.leave(), "C-LS-08")


@pytest.mark.requirement("C-LS-08")
def test_without_a_node_id_it_is_silent(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """No boot-up, heartbeat or SDO answer; with one it boots up under it."""
    known(bench, sdo, sheet)
    may_configure(bench)
    lose_node_id(bench, lss)
    since = bench.now()
    sdo.post(sdo_frames.read(DEVICE_TYPE, 0))
    bench.send(nmt_frame(Nmt.START, 0))
    bench.never(matchers.anything(), after=since, for_ns=3 * S)
    lss.configure()
    found = lss.inquire(4)
    text = f"the node id is 255; it is {found}"
    bench.check(found == services.UNCONFIGURED, text, requirement="C-LS-07")
    regain_node_id(bench, lss)
    sdo.read(DEVICE_TYPE, requirement="C-LS-08")


@pytest.mark.requirement("C-LS-09")
def test_a_node_with_a_node_id_does_not_answer_the_search(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """Neither identify non-configured nor fast scan, in no state."""
    known(bench, sdo, sheet)
    for state in RUNNING_STATES:
        go(bench, state)
        lss.silence(services.identify_unconfigured())
        lss.silence(services.fast_scan(0, 0x80, 0, 0))
    go(bench, State.PRE_OPERATIONAL)


@pytest.mark.requirement("C-LS-09")
def test_fast_scan_finds_a_node_without_a_node_id(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """Its whole identity, bit by bit, and it is in configuration then."""
    identity = known(bench, sdo, sheet)
    may_configure(bench)
    lose_node_id(bench, lss)
    lss.expect(services.NOT_CONFIGURED, services.identify_unconfigured())
    found = lss.fast_scan()
    bench.check(found == identity, f"fast scan finds {identity}; it found {found}")
    lss.inquire(4, "C-LS-09")
    regain_node_id(bench, lss)


@pytest.mark.requirement("C-LS-11")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_in_which_states_it_listens_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss, state: State
) -> None:
    """Pre-operational, operational and stopped: some devices serve LSS in two of them."""
    identity = known(bench, sdo, sheet)
    go(bench, state)
    answer = lss.ask(*services.select(identity))
    told = "is served" if answer else "is not served"
    bench.characteristic("C-LS-11", f"LSS {told} in {state}")
    lss.leave()
    bench.wait(10 * MS)
