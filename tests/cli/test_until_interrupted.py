"""A server that waits for an interrupt ends whenever that comes, also just before it begins to wait."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import random, signal
from manitwin.cli.interrupt import wait_for_interrupt

draw = random.Random(1)
signal.signal(signal.SIGALRM, signal.SIG_IGN)
for number in range(20000):
    with wait_for_interrupt((signal.SIGALRM,)) as wait:
        signal.setitimer(signal.ITIMER_REAL, draw.uniform(5e-6, 8e-5))
        wait()
print(number + 1)
"""
"""With an Event that the handler sets, this waits for ever after some of these rounds."""


def test_no_interrupt_is_missed_whenever_it_comes() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (0, "20000\n"), done.stderr
