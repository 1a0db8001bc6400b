"""Settings of all tests: hypothesis times none of them, and an interrupt reaches the programs that they start."""

import signal

from hypothesis import settings

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

if (
    signal.getsignal(signal.SIGINT) is signal.SIG_IGN
):  # a shell starts programs in the background so, and children inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)
