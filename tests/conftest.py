"""What holds for all tests."""

from hypothesis import settings

# A computer that is busy with other tests takes long over any example; speed is measured in benchmarks. What the
# environment chose before, as repeatable examples in CI, stays.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")
