"""Limits of a shell (ulimit) and of a disk under which a command cannot work, told in one line.

This is imported before all else, and imports nothing that takes time.
"""

from __future__ import annotations

import errno
import resource

GIB = 1 << 30
LIBRARIES_NEED = 3 * GIB
"""Address space of a command that reads data sets: 2.5 GiB were measured, of which libraries reserve most and fill little."""
WORKERS_NEED = 4 * GIB
"""That of a worker that simulates and renders: 3.3 GiB were measured."""
WITH_WORKERS = frozenset({"build", "run", "layout", "trajectories", "render"})
WITHOUT_LIBRARIES = frozenset({"status", "doctor", "completion", "schema"})
RESUMABLE_STATUS, USAGE_STATUS = 4, 2
_MAKE_ROOM = "free disk space, then rerun the same command"
_REMEDIES = {
    errno.ENOSPC: _MAKE_ROOM,
    errno.EDQUOT: _MAKE_ROOM,
    errno.EFBIG: "the file size limit is exceeded (ulimit -f); raise it",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
    errno.ENFILE: "close other programs",
    errno.EAGAIN: "raise the limit of processes (ulimit -u), or close other programs",
    errno.ENOMEM: "close other programs, or use fewer --jobs",
    errno.EIO: "check the disk, then rerun the same command",
    errno.ESTALE: "mount the file system again, then rerun the same command",
}
_WRONG_PATHS = frozenset({
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG,
    errno.ENOTEMPTY, errno.EEXIST, errno.EXDEV, errno.ENXIO, errno.ENODEV,
})  # fmt: skip


def memory_limit_message(arguments: list[str]) -> str | None:
    """Return what is said where ``ulimit -v`` leaves a command less than its libraries map; None where there is enough."""
    command = next((each for each in arguments if not each.startswith("-")), "")
    if not command or command in WITHOUT_LIBRARIES or {"--help", "-h"} & set(arguments):
        return None
    needed = WORKERS_NEED if command in WITH_WORKERS else LIBRARIES_NEED
    allowed, _ = resource.getrlimit(resource.RLIMIT_AS)
    if allowed == resource.RLIM_INFINITY or allowed >= needed:
        return None
    instead = (
        "; run.memory_gb in the configuration bounds the memory that each worker uses"
        if command in WITH_WORKERS
        else ""
    )
    return (
        f"manitwin {command}: memory is limited to {allowed / GIB:.1f} GiB of address space (ulimit -v), and {needed // GIB} GiB"
        f" are needed; raise that limit (ulimit -v unlimited){instead}"
    )


def machine_error_message(error: Exception) -> tuple[str, int] | None:
    """Return the line and the exit status for what a disk, a limit or a path has to do with; None for anything else."""
    if isinstance(error, MemoryError):
        return f"out of memory; {_REMEDIES[errno.ENOMEM]}", RESUMABLE_STATUS
    if isinstance(error, RuntimeError) and "start new thread" in str(error):
        return f"no thread can be started; {_REMEDIES[errno.EAGAIN]}", RESUMABLE_STATUS
    if type(error).__module__ == "sqlite3" and type(error).__name__ == "OperationalError":
        return (
            f"the ledger cannot be written ({error}); {_MAKE_ROOM}, or raise the limits (ulimit -a)",
            RESUMABLE_STATUS,
        )
    if not isinstance(error, OSError) or isinstance(error, ConnectionError):
        return None
    name = error.filename if isinstance(error.filename, str | bytes) else ""
    where = f"{name.decode(errors='replace') if isinstance(name, bytes) else name}: " if name else ""
    if error.errno in _REMEDIES:
        return f"{where}{error.strerror}; {_REMEDIES[error.errno]}", RESUMABLE_STATUS
    if error.errno in _WRONG_PATHS:
        return f"{where}{error.strerror}; check the path and its permissions", USAGE_STATUS
    return None
