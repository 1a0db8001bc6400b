import pytest

from hsm.model.registry import Library
from tests.dsl.library import make_library


@pytest.fixture(scope="session")
def library() -> Library:
    return make_library()
