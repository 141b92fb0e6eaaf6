"""`hairkit` and `python -m hairkit` are the command line.

Nothing is loaded before Ctrl-C is answered in one line. The first Ctrl-C lets the steps that are
running end, the second ends the process, whatever its threads do.
"""

import io
import os
import sys

ENDED_BY_CTRL_C = 130
"""Exit code after the second Ctrl-C: 128 and the number of the signal, as shells have it."""
SOON_S = 0.5
"""Seconds in which a run that stops at once needs no message."""


def main() -> int:
    """Run the command line and return its exit code."""
    _open_standard_streams()
    try:
        _end_at_second_interrupt()
        from hairkit.cli import main as run
        from hairkit.memory import keep_freed_memory

        keep_freed_memory()
        return run()
    except KeyboardInterrupt:
        print("hairkit: interrupted", file=sys.stderr)
        return 2


def _open_standard_streams() -> None:
    """Let nothing that is opened later take the place of a standard stream that is closed.

    What a stream cannot write, such as a name in other letters than a Windows console has, is
    written as an escape.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
            setattr(sys, name, os.fdopen(number, "w" if number else "r"))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _end_at_second_interrupt() -> None:
    """Start a thread that counts Ctrl-C: the main thread may wait for a plugin that hangs."""
    import atexit
    import signal
    import socket
    import threading

    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return  # a background job ignores it

    def interrupt(number: int, frame: object) -> None:
        """Raise `KeyboardInterrupt` once; what comes after that belongs to the thread.

        Raised a second time, it would break into a `join`, and Python 3.11 takes a thread whose
        `join` was interrupted for one that ended: the process would leave with another exit code.
        """
        signal.signal(signal.SIGINT, lambda number, frame: None)
        raise KeyboardInterrupt

    def wait() -> None:
        while heard.recv(1) != bytes([signal.SIGINT]):
            pass  # another signal that Python handles

    def listen() -> None:
        wait()
        heard.settimeout(SOON_S)
        try:
            wait()
        except TimeoutError:
            os.write(2, b"hairkit: stopping; press Ctrl-C again to end at once\n")
            heard.settimeout(None)
            wait()
        os.write(2, b"hairkit: ended at once\n")
        os._exit(ENDED_BY_CTRL_C)

    heard, pressed = socket.socketpair()
    pressed.setblocking(False)
    signal.set_wakeup_fd(pressed.detach(), warn_on_full_buffer=False)
    signal.signal(signal.SIGINT, interrupt)
    # when all threads have ended, nothing but the exit code is left to be lost
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=listen, name="ctrl-c", daemon=True).start()


if __name__ == "__main__":
    sys.exit(main())
