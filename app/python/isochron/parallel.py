"""How many threads render."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from isochron.errors import InputError
from isochron.experiment import extension


def set_threads(count: int) -> None:
    """Threads that render from now on; 0: all cores. Results do not depend on it."""
    if not 0 <= count <= 4096:
        raise InputError(f"threads: {count} is out of range (allowed: 0 to 4096)")
    extension().use_threads(count)


@contextlib.contextmanager
def threads(count: int) -> Iterator[None]:
    """As set_threads, within a `with` block."""
    before = extension().used_threads()
    set_threads(count)
    try:
        yield
    finally:
        set_threads(before)
