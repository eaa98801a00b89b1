"""Plots that stand for themselves: one SVG file, light and dark, without scripts or fonts.

Every text is escaped, whatever a device, a file or a test is called.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.sax.saxutils import escape, quoteattr

COLOURS = ("#1f6feb", "#d4771c", "#2e8b57", "#a04fd0", "#c2255c", "#0b8793", "#8a6d3b", "#5f6b7a")
"""Of series, one after the other; each is legible on white and on black."""

_STYLE = """
svg{background:#fff;font:12px system-ui,sans-serif}
text{fill:#222}.grid{stroke:#ddd}.limit{stroke:#c00;stroke-dasharray:4 3}.dim{fill:#667}
@media(prefers-color-scheme:dark){svg{background:#15181c}text{fill:#e6e6e6}.grid{stroke:#333}.dim{fill:#9aa}}
"""


def element(name: str, text: str = "", **attributes: object) -> str:
    """An element with escaped attributes and text; `class_` is written `class`."""
    shown = "".join(
        f" {key.rstrip('_').replace('_', '-')}={quoteattr(_value(value))}"
        for key, value in attributes.items()
    )
    return f"<{name}{shown}>{escape(_printable(text))}</{name}>"


def _value(value: object) -> str:
    return f"{value:.1f}" if isinstance(value, float) else _printable(str(value))


def _printable(text: str) -> str:
    return "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in text)


def titled(shape: str, title: str) -> str:
    """A shape whose title the pointer shows."""
    return f"<g>{element('title', title)}{shape}</g>"


def document(width: int, height: int, title: str, parts: Iterable[str]) -> str:
    """A whole SVG file."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" role="img">'
        f"{element('title', title)}<style>{_STYLE}</style>{''.join(parts)}</svg>\n"
    )


def legend(names: Sequence[str], x: float, y: float) -> list[str]:
    """A line for each series, in its colour."""
    parts = []
    for place, name in enumerate(names):
        at = y + 18.0 * place
        colour = COLOURS[place % len(COLOURS)]
        parts.append(element("circle", cx=x, cy=at - 4.0, r=5, fill=colour))
        parts.append(element("text", name, x=x + 12.0, y=at))
    return parts


class ShareAxis:
    """Where a margin, as a share of what its limits allow, stands along a line of pixels.

    Beyond the limit all is one: it ends a little past it.

    Args:
        start: pixel of the least.
        stop: pixel of 100 %.
    """

    LEAST = -0.1

    def __init__(self, start: float, stop: float) -> None:
        self._start, self._stop = start, stop

    def at(self, share: float) -> float:
        """The pixel of a share."""
        inside = min(max(share, self.LEAST), 1.0)
        part = (inside - self.LEAST) / (1 - self.LEAST)
        return self._start + (self._stop - self._start) * part

    def ticks(self) -> list[tuple[float, str, str]]:
        """Pixel, text and class of each line of the grid."""
        marks = [(0.0, "limit", "limit")]
        marks += [(step / 4, f"{25 * step} %", "grid") for step in range(1, 5)]
        return [(self.at(share), text, class_) for share, text, class_ in marks]
