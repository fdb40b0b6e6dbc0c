"""A disk that becomes full after so many bytes."""

from __future__ import annotations

import errno
import os

import pytest

__all__ = ["limit_disk"]


def limit_disk(monkeypatch: pytest.MonkeyPatch, room: int, *, truncates: bool = True) -> None:
    """Leave so many bytes on the disk: a write takes what fits, the next one is refused."""
    left, write = [room], os.write

    def limited(file: int, content: bytes) -> int:
        if not left[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count = write(file, bytes(content)[: left[0]])
        left[0] -= count
        return count

    def refuse(*_: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, "write", limited)
    if not truncates:
        monkeypatch.setattr(os, "ftruncate", refuse)
