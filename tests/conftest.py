"""What holds for all tests."""

import signal

from hypothesis import settings

# A computer that is busy with other tests takes long over any example; speed is measured in benchmarks. What the
# environment chose before, as repeatable examples in CI, stays.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

# A shell starts programs in the background with Ctrl-C ignored, and the programs of the tests would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
