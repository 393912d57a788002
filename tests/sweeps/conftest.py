"""Commands of these tests run the rig that does not move with the default one."""

import pytest

from tests.conftest import RIG


@pytest.fixture(scope="session")
def rig_path():
    return RIG
