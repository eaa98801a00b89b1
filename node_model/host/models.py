"""Builds the node that is to be hosted, by the names of the command line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from node_model import keypad
from node_model.host.wires import WireError
from node_model.keypad.parameters import NODE_IDS
from node_model.node import Panel


class UnknownModelError(ValueError):
    """No such profile or mutant; the text names near misses."""


def make_node(profile: str, mutant: str | None, node_id: int | None, image: bytes | None) -> Panel:
    """The node under a profile, switched off.

    Args:
        profile: name of a bundled profile, or path of a TOML file.
        mutant: name of a faulty or different model of `node_model.faults`; None = sound.
        node_id: node id of the factory's parameters, 1..15; None = the profile's.
        image: content of its non-volatile memory; None = as it leaves the factory.

    Raises:
        UnknownModelError: no such profile or mutant, or a node id out of range.
    """
    try:
        facts = keypad.load(profile)
    except OSError:
        raise UnknownModelError(f"no profile {profile!r}: a bundled name or a file") from None
    except (KeyError, ValueError) as error:
        raise UnknownModelError(f"profile {profile!r} is not usable: {error}") from None
    if node_id is not None:
        if node_id not in NODE_IDS:
            ids = f"{NODE_IDS[0]}..{NODE_IDS[-1]}"
            raise UnknownModelError(f"node id {node_id} is none of the keypad's, {ids}")
        facts = replace(facts, factory=replace(facts.factory, node_id=node_id))
    if mutant is None:
        return keypad.Keypad(facts, image or b"")
    from node_model import faults  # noqa: PLC0415 - loaded only for a mutant

    try:
        return faults.make(mutant, facts, image or b"")
    except ValueError as error:
        raise UnknownModelError(str(error)) from None


def read_image(path: Path) -> bytes | None:
    """Memory of an earlier life; None where there is no such file yet."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise WireError(f"storage {path}: {error.strerror}") from None


def write_image(path: Path, image: bytes) -> None:
    """Replace the file in one step, so that a crash leaves the old or the new one."""
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_bytes(image)
    fresh.replace(path)
