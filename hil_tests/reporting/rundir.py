"""The folder of a run: `reports/<run>/` with `traces/`, and `reports/latest`.

Laws: an older run is never touched; a trace has a name that every file system takes,
whatever the test is called, and the same test always gets the same one.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import NoReturn

from hil_tests.errors import ConfigError
from hil_tests.reporting.files import replace_file

__all__ = ["RunDirectory", "replace_file"]

_TRIES = 100
_NAME_LENGTH = 80
_STRANGE = re.compile(r"[^A-Za-z0-9_.]+")


@dataclass(frozen=True, slots=True)
class RunDirectory:
    """Where one run writes; an existing one can be opened by its path."""

    path: Path

    @classmethod
    def create(cls, reports: Path, started: datetime) -> RunDirectory:
        """A new folder in `reports`, and `latest` pointing to it.

        Args:
            reports: made if it is not there.
            started: names the folder, in UTC; must know its time zone.

        Raises:
            ConfigError: it cannot be made there; the text names the remedy.
        """
        try:
            reports.mkdir(parents=True, exist_ok=True)
            run = cls._fresh(reports, started)
        except OSError as error:
            _refuse(reports, error)
        run.point()
        return run

    @classmethod
    def _fresh(cls, reports: Path, started: datetime) -> RunDirectory:
        """A folder that was not there before, even if two runs start in the same second."""
        for _ in range(_TRIES):
            run = cls.named(reports, started)
            try:
                run.path.mkdir()
            except FileExistsError:
                continue
            return run
        raise FileExistsError(17, f"{_TRIES} names of this second are taken")

    @classmethod
    def named(cls, reports: Path, started: datetime) -> RunDirectory:
        """A name in `reports` that no other run has; nothing is made yet."""
        stamp = started.astimezone(UTC).strftime("%Y%m%dT%H%M%SZ")
        return cls(reports / f"{stamp}-{secrets.token_hex(2)}")

    def make(self) -> RunDirectory:
        """The folder and what lies in it, where it is not there yet.

        Raises:
            ConfigError: it cannot be made there; the text names the remedy.
        """
        try:
            self.traces.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            _refuse(self.path.parent, error)
        return self

    def point(self) -> None:
        """Make it, and let `latest` point to it.

        Raises:
            ConfigError: it cannot be made there; the text names the remedy.
        """
        self.make()
        try:
            _point(self.path.parent, self.path.name)
        except OSError as error:
            _refuse(self.path.parent, error)

    @property
    def traces(self) -> Path:
        """The folder of its recordings."""
        return self.path / "traces"

    def trace_path(self, test: str, part: str = "") -> Path:
        """Where the recording of a test goes.

        Args:
            test: node id, whatever it holds.
            part: tells several recordings of one test apart.
        """
        module, _, name = test.partition("::")
        module = module.rpartition("/")[2].removesuffix(".py")
        readable = "-".join(filter(None, (module, name, part)))
        slug = _STRANGE.sub("-", readable).strip("-._")[:_NAME_LENGTH]
        whole = f"{test}\0{part}".encode("utf-8", "surrogatepass")
        return self.traces / f"{slug or 'test'}-{hashlib.sha256(whole).hexdigest()[:10]}.pcapng"

    def relative(self, path: Path) -> str:
        """How `results.json` names a file of this run: from its folder, with slashes."""
        return path.relative_to(self.path).as_posix()


def _point(reports: Path, run: str) -> None:
    """`latest` names the run: a link, or where there are none a file with its name.

    A folder of that name is someone's own and stays; the name then goes to latest.txt.
    """
    latest = reports / "latest"
    if latest.is_dir() and not latest.is_symlink():
        latest = reports / "latest.txt"
    draft = reports / f".latest.{run}"
    try:
        draft.symlink_to(run, target_is_directory=True)
        os.replace(draft, latest)  # noqa: PTH105  Path.replace would do the same
    except (OSError, NotImplementedError):
        draft.unlink(missing_ok=True)
        replace_file(latest, f"{run}\n".encode())


def _refuse(reports: Path, error: OSError) -> NoReturn:
    raise ConfigError(
        f"reports folder {reports}: {error.strerror or error}; make it writable or choose "
        "another place with --can-reports DIR"
    ) from error
