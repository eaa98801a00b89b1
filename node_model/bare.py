"""What a device without keys and LEDs answers to a bench that asks for some."""

from __future__ import annotations

from node_model.node import NOTHING, Frames, refuse_strangers


class Bare:
    """The part of a `Panel` that is not there."""

    name: str
    keys: tuple[str, ...] = ()
    leds: tuple[str, ...] = ()

    def hold(self, held: frozenset[str], now: int) -> Frames:  # noqa: ARG002  a verb of every panel
        """It has no keys.

        Raises:
            ValueError: a name.
        """
        refuse_strangers("key", held, self.keys, self.name)
        return NOTHING

    def lit(self, led: str, now: int) -> bool:  # noqa: ARG002  a verb of every panel
        """It has no LEDs.

        Raises:
            ValueError: always.
        """
        raise ValueError(f"no LED {led}; this {self.name} has none")

    def lamp_change(self, now: int) -> int | None:  # noqa: ARG002  a verb of every panel
        """It has no LEDs."""
        return None
