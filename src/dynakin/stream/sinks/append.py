"""The recorder's own process: copies its standard input to a file, and on to the disk twice a second.

Run as a script, with the standard library alone, so that it is there at once. If the session ends in any way, what it
has sent is written; if this process ends in any way, what it has written stays. Where the disk takes no more it ends
with `SYSTEM_ERROR` and the number of the system's error: Python itself ends with 1 where something else is wrong.
"""

import os
import select
import sys
import time

SYNC_S = 0.5
SYSTEM_ERROR = 100


def main(path: str) -> None:
    """Until the input ends.

    Raises:
        OSError: the file takes no more.
    """
    out = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    synced, dirty = time.monotonic(), False
    while True:
        ready = select.select([0], [], [], SYNC_S)[0] if os.name == "posix" else [0]
        if ready:
            data = os.read(0, 1 << 16)
            if not data:
                break
            while data:
                data = data[os.write(out, data) :]
            dirty = True
        if dirty and time.monotonic() - synced > SYNC_S:
            os.fsync(out)
            synced, dirty = time.monotonic(), False
    os.fsync(out)
    os.close(out)


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except OSError as error:
        sys.exit(SYSTEM_ERROR + error.errno if error.errno else 1)
