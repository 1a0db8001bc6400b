import pytest

from tests.hsm import charts


@pytest.fixture(autouse=True)
def _forget():
    """Nothing that a machine leaves behind is seen by the next test."""
    charts.ASKED.clear()
    charts.DONE.clear()
    charts.Work.made.clear()
