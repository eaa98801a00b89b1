"""What a trace holds besides frames, as plain data: stimuli, bus events, verdict marks.

In a pcapng file each is a packet of an interface of its own, in the form that Wireshark
uses for exported payloads (link type 252): a few tags, one of which names the dissector
"json", then the JSON text. So it stands in its place among the frames, shows its text as
a comment, unfolds as JSON, and can be read back whole.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from collections.abc import Set as AbstractSet

from hil_tests.clock import show_span
from hil_tests.trace import BusEvent, EventKind, Mark, Moment

INTERFACE = "nodeproof journal/1"
"""Name of the interface; the number rises when its JSON can no longer be read as before."""

_TAG_END = 0
_TAG_DISSECTOR = 12
_TAG_COLUMN = 33
_TEXT_LIMIT = 2000


Note = Moment | BusEvent | Mark


def _tag(code: int, text: bytes = b"") -> bytes:
    """Code and length, 16 bits each and big-endian; the length counts the padding too."""
    text += bytes(-len(text) % 4)
    return code.to_bytes(2, "big") + len(text).to_bytes(2, "big") + text


_PREFIX = _tag(_TAG_DISSECTOR, b"json") + _tag(_TAG_COLUMN, b"nodeproof") + _tag(_TAG_END)


def pack(note: Note) -> bytes:
    """The packet of a note.

    Raises:
        TypeError, ValueError: its data are no plain data (texts, numbers, truth values,
            lists, mappings with texts as keys).
    """
    return told(note)[0]


def told(note: Note) -> tuple[bytes, str]:
    """The packet of a note, and `describe`: what both hold of a stimulus is written once."""
    if not isinstance(note, Moment):
        return _PREFIX + _dumps(_fields(note)), describe(note)
    detail = _dumps(note.detail)
    head = _dumps(_fields(note))
    return _PREFIX + head[:-1] + b',"detail":' + detail + b"}", _line(note, detail)


def stamp(note: Note) -> int:
    """The instant at which it stands among the frames, in ns."""
    return note.began_at if isinstance(note, Moment) else note.at


def describe(note: Note) -> str:
    """One line for people, cut where it would fill the screen."""
    if isinstance(note, Moment):
        return _line(note, _dumps(note.detail))
    if isinstance(note, Mark):
        return _cut(note.text)
    lost = f" ({note.lost} frames lost)" if note.lost else ""
    return _cut(": ".join(part for part in (note.kind.value, note.text) if part) + lost)


def _line(moment: Moment, detail: bytes) -> str:
    """A stimulus for people, its detail being written out."""
    text = f"{moment.what} {detail.decode()}" if moment.detail else moment.what
    if moment.ended_at != moment.began_at:
        text += f", took effect within {show_span(moment.ended_at - moment.began_at)}"
    return _cut(text)


def _cut(text: str) -> str:
    return text if len(text) <= _TEXT_LIMIT else f"{text[: _TEXT_LIMIT - 3]}..."


def unpack(packet: bytes) -> Note:
    """The note in a packet.

    Raises:
        ValueError: it is none; the text says what is wrong with it.
    """
    try:
        found = json.loads(packet[_payload_at(packet) :].decode())
    except RecursionError:
        raise ValueError("its JSON is nested too deeply") from None
    if not isinstance(found, dict):
        raise ValueError("its JSON is no object")
    reader = _READERS.get(str(found.get("kind")))
    if reader is None:
        raise ValueError(f"a note of an unknown kind, {str(found.get('kind'))[:40]!r}")
    return reader(found)


def _payload_at(packet: bytes) -> int:
    """Where the JSON begins: past the tags, ours or another's."""
    if packet.startswith(_PREFIX):
        return len(_PREFIX)
    place = 0
    while place + 4 <= len(packet):
        code = int.from_bytes(packet[place : place + 2], "big")
        place += 4 + int.from_bytes(packet[place + 2 : place + 4], "big")
        if code == _TAG_END:
            return place
    raise ValueError("its tags have no end")


def _plain(value: object) -> object:
    """What JSON has no word for: any mapping becomes an object, a set a sorted list."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, AbstractSet):
        return sorted(value)
    raise TypeError(f"{type(value).__name__} {str(value)[:60]!r} is no plain data")


_encode = json.JSONEncoder(separators=(",", ":"), allow_nan=False, default=_plain).encode


def _dumps(value: object) -> bytes:
    return _encode(value).encode("ascii")


def _fields(note: Note) -> dict[str, object]:
    """The note as plain data, without the detail of a stimulus."""
    if isinstance(note, Mark):
        return {"kind": "mark", "at": note.at, "text": note.text, "data": note.data}
    if isinstance(note, BusEvent):
        kind = note.kind.name
        return {
            "kind": "event",
            "event": kind,
            "at": note.at,
            "text": note.text,
            "lost": note.lost,
        }
    return {
        "kind": "moment",
        "what": note.what,
        "began_at": note.began_at,
        "ended_at": note.ended_at,
    }


def _whole(fields: Mapping[str, object], key: str) -> int:
    value = fields.get(key)
    if not isinstance(value, int) or isinstance(value, bool):
        raise ValueError(f"its {key!r} is no whole number")
    return value


def _text(fields: Mapping[str, object], key: str) -> str:
    value = fields.get(key)
    if not isinstance(value, str):
        raise ValueError(f"its {key!r} is no text")
    return value


def _object(fields: Mapping[str, object], key: str) -> dict[str, object]:
    value = fields.get(key)
    if not isinstance(value, dict):
        raise ValueError(f"its {key!r} is no object")
    return value


def _mark(fields: Mapping[str, object]) -> Mark:
    return Mark(_whole(fields, "at"), _text(fields, "text"), _object(fields, "data"))


def _event(fields: Mapping[str, object]) -> BusEvent:
    name = _text(fields, "event")
    if name not in EventKind.__members__:
        raise ValueError(f"an event of an unknown kind, {name[:40]!r}")
    kind = EventKind[name]
    return BusEvent(kind, _whole(fields, "at"), _text(fields, "text"), _whole(fields, "lost"))


def _moment(fields: Mapping[str, object]) -> Moment:
    began_at, ended_at = _whole(fields, "began_at"), _whole(fields, "ended_at")
    return Moment(_text(fields, "what"), began_at, ended_at, _object(fields, "detail"))


_READERS: dict[str, Callable[[Mapping[str, object]], Note]] = {
    "mark": _mark,
    "event": _event,
    "moment": _moment,
}
