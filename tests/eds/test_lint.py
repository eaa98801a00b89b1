"""The lint: each rule finds its fault at its line, and says nothing of a sound file."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests import cli
from hil_tests.eds import Severity, lint
from tests.eds.reading import FILES, SOUND, changed, found, line_of, sheet


def test_a_sound_file_has_no_findings() -> None:
    """Not even a warning."""
    assert found(sheet(SOUND)) == []


CASES = [
    # old, new, rule, text; the finding stands where `new` begins, unless a place is named
    ("SupportedObjects=8", "SupportedObjects=9", "C-EDS-01", "says 9, and 8 are listed"),
    ("SupportedObjects=8", "SupportedObjects=x", "C-EDS-01", "says no number"),
    ("8=0x1A00", "9=0x1A00", "C-EDS-01", "has no entry 8"),
    ("8=0x1A00", "8=0x1A01", "C-EDS-01", "object 1A01h has no section"),
    ("8=0x1A00", "8=0x1A01", "C-EDS-01", "object 1A00h stands in no list"),
    ("8=0x1A00", "8=0x1800", "C-EDS-01", "object 1800h is listed in line"),
    ("8=0x1A00", "8=1A00h", "C-EDS-01", "entry 8 of [OptionalObjects] is '1A00h'"),
    ("8=0x1A00", "8=0x2000", "C-EDS-01", "object 2000h does not belong into [OptionalObjects]"),
    ("[OptionalObjects]", "[Optional]", "C-EDS-01", "there is no section [OptionalObjects]"),
    ("[DeviceInfo]", "[Device]", "C-EDS-01", "there is no section [DeviceInfo]"),
    ("[1001]", "[3001]", "C-EDS-02", "mandatory object 1001h is missing"),
    ("[1018sub1]", "[1018sub7]", "C-EDS-02", "mandatory object 1018h:01 is missing"),
    ("[1017]", "[2017]", "C-EDS-02", "neither heartbeat (1017h) nor guarding"),
    ("DefaultValue=1000", "DefaultValue=65536", "C-EDS-03", "which no UNSIGNED16 can be"),
    ("LowLimit=0\n", "LowLimit=1001\n", "C-EDS-03", "below its LowLimit 1001"),
    ("HighLimit=0xFFFF", "HighLimit=999", "C-EDS-03", "above its HighLimit 999"),
    ("LowLimit=0x8000", "LowLimit=2\nParameterValue=1", "C-EDS-03", "ParameterValue of 2001h:00"),
    ("HighLimit=0x7FFF", "HighLimit=0x8000\n;", "C-EDS-03", ""),
    ("LowLimit=0\nHighLimit=0xFFFF", "LowLimit=9\nHighLimit=8", "C-EDS-03", "above HighLimit 8"),
    ("DefaultValue=1000", "DefaultValue=0144", "C-EDS-03", "octal to some readers"),
    ("SubNumber=5", "SubNumber=4", "C-EDS-04", "SubNumber of 1018h is 4, and it has 5"),
    ("SubNumber=5\n", "", "C-EDS-04", "SubNumber of 1018h is missing"),
    ("DefaultValue=4\n", "DefaultValue=3\n", "C-EDS-04", "1018h:00 is 3, and the highest"),
    ("[1018sub0]", "[1018sub9]", "C-EDS-04", "1018h has no sub-index 0"),
    ("0x20000108", "0x20000408", "C-EDS-05", "maps 2000h:04, which does not exist"),
    ("0x20000108", "0x10140020", "C-EDS-05", "maps 1014h:00, which cannot be mapped"),
    ("0x20000108", "0x20000110", "C-EDS-05", "with 16 bits; it has 8"),
    ("0x00050008", "0x00060010", "C-EDS-05", "a dummy that [DummyUsage] does not allow"),
    ("0x20010010", "0x00050008", "C-EDS-05", "a dummy, in a TPDO"),
    ("0x20000108", "0x20010010", "C-EDS-06", "a RPDO, maps 2001h:00, which is rwr"),
    ("0x20010010", "0x20000108", "C-EDS-06", "a TPDO, maps 2000h:01, which is rww"),
    ("ParameterName=Name", "ParametreName=Name", "C-EDS-07", "is ParameterName meant?"),
    ("Lines=1", "Lines=1\n[Zzz]", "C-EDS-07", "section [Zzz] is not known; drop it"),
    ("SupportedObjects=8", "SupportedObjects=8\nCount=8", "C-EDS-07", "option Count"),
    ("NrOfRXPDO=1", "NrOfRXPDO=2", "C-EDS-10", "NrOfRXPDO is 2, and 1 are described"),
    ("NrOfTXPDO=1", "NrOfTXPDO=0", "C-EDS-10", "NrOfTXPDO is 0, and 1 are described"),
    ("Granularity=8", "Granularity=65", "C-EDS-10", "Granularity is 65"),
    ("RevisionNumber=0x00010003", "RevisionNumber=4", "C-EDS-10", "RevisionNumber is 0x4"),
]


@pytest.mark.parametrize(("old", "new", "rule", "text"), CASES)
def test_a_fault_is_found(old: str, new: str, rule: str, text: str) -> None:
    """One change of the sound file, one finding of that rule which says so."""
    said = [line for line in found(changed((old, new))) if f": {rule}: " in line and text in line]
    assert said


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("SupportedObjects=8", "SupportedObjects=9", "SupportedObjects=8"),
        ("LowLimit=0\n", "LowLimit=1001\n", "DefaultValue=1000"),
        ("SubNumber=5", "SubNumber=4", "[1018]"),
        ("0x20000108", "0x20000110", "0x20000108"),
        ("NrOfRXPDO=1", "NrOfRXPDO=2", "NrOfRXPDO=1"),
    ],
)
def test_a_finding_has_the_line_of_its_fault(old: str, new: str, place: str) -> None:
    """That of the value, or of the section where it is missing; and a remedy."""
    (finding,) = lint(changed((old, new)))
    assert finding.line == line_of(place)
    assert finding.severity is Severity.ERROR
    assert finding.remedy


@pytest.mark.parametrize(("bits", "fits"), [("40", True), ("41", False)])
def test_a_pdo_has_64_bits(bits: str, fits: bool) -> None:
    """All entries together; an object without a size of its own may have any."""
    read = changed(
        ("DefaultValue=2\n", "DefaultValue=1\n"),
        ("0x20000108", f"0x200200{bits}"),
        ("ObjectType=0x2\nAccessType=rw", "ObjectType=0x2\nAccessType=rww\nPDOMapping=1"),
    )
    assert any("maps 65 bits by default" in text for text in found(read)) != fits
    assert (found(read) == []) == fits


def test_a_pdo_has_both_parameters() -> None:
    """Without its mapping it is incomplete."""
    read = sheet(SOUND.replace("[1600", "[1610").replace("0x1600", "0x1610"))
    (text,) = found(read)
    assert "C-EDS-10: 1400h has no mapping parameter 1600h" in text


def test_plain_rw_is_a_warning() -> None:
    """A mapped object that is rw may be meant for the other direction."""
    (finding,) = lint(changed(("AccessType=rwr", "AccessType=rw")))
    assert finding.severity is Severity.WARNING
    assert "x.eds:" in str(finding)
    assert ": C-EDS-06: warning: " in str(finding)


def test_bit_rates_must_be_told() -> None:
    """A device without any is none."""
    read = changed(*((f"BaudRate_{rate}=1", f"BaudRate_{rate}=0") for rate in (125, 250, 1000)))
    assert any("no BaudRate_... is 1" in text for text in found(read))


def test_a_mapping_that_is_switched_off_is_not_looked_at() -> None:
    """No entries by default, multiplexed PDOs, and an entry of 0."""
    for pairs in (
        [("DefaultValue=2\n", "DefaultValue=0\n"), ("0x20000108", "0x99990108")],
        [("0x00050008", "0")],
    ):
        assert found(changed(*pairs)) == []


def test_the_command_prints_findings_and_ends_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """0 for a sound file, 1 for one with errors, 0 with warnings alone, 4 without a file."""
    sound = str(FILES / "sound.eds")
    assert cli.main(["eds", sound]) == 0
    assert capsys.readouterr().out == ""
    wrong = tmp_path / "wrong.eds"
    wrong.write_text(SOUND.replace("SubNumber=5", "SubNumber=4"))
    assert cli.main(["eds", sound, str(wrong)]) == 1
    line = line_of("[1018]")
    assert capsys.readouterr().out == (
        f"{wrong}:{line}: C-EDS-04: SubNumber of 1018h is 4, and it has 5 sub-indices; "
        "write SubNumber=5\n"
    )
    wrong.write_text(SOUND.replace("ParameterName=Name", "Name=Name"))
    assert cli.main(["eds", str(wrong)]) == 0
    assert "C-EDS-07: warning:" in capsys.readouterr().out
    assert cli.main(["eds", str(tmp_path / "none.eds")]) == 4
    assert "none.eds: cannot be read" in capsys.readouterr().err
