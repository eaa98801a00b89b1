"""The state in git of the folder that the tests come from."""

from __future__ import annotations

import subprocess
from pathlib import Path

_PATIENCE_S = 10


def git_state(root: Path) -> dict[str, object] | None:
    """Commit, and whether files differ from it; None outside a checkout, or without git.

    Args:
        root: a folder of the checkout.
    """
    commit = _ask(root, "rev-parse", "--verify", "HEAD")
    changed = _ask(root, "status", "--porcelain")
    if not commit or changed is None:
        return None
    return {"commit": commit, "dirty": bool(changed)}


def _ask(root: Path, *words: str) -> str | None:
    """What git says; None where it says nothing good."""
    command = ["git", "-C", str(root), "--no-optional-locks", *words]
    try:
        done = subprocess.run(
            command, check=True, capture_output=True, text=True, timeout=_PATIENCE_S
        )
    except (OSError, ValueError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
