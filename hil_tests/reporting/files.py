"""Files of a run: replaced as a whole or not at all, and one error where one is no good."""

from __future__ import annotations

import os
import secrets
from pathlib import Path

from hil_tests.errors import BenchError


class RecordUnreadable(BenchError):
    """A trace or results file is not what it should be; the text names file and place."""


def replace_file(path: Path, content: bytes) -> None:
    """Write a file so that others see the old content or the new one, never a part.

    The content is on the disk before the name points to it, so a power cut keeps one of
    the two as well.

    Raises:
        OSError: the folder is not there or cannot be written; the old file is untouched.
    """
    draft = path.with_name(f".{path.name[:64]}.{secrets.token_hex(4)}")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
