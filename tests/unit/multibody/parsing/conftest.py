"""What the tests of all formats share."""

import pytest

from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.plant import MultibodyPlant


@pytest.fixture
def plant():
    return MultibodyPlant(1e-3)


@pytest.fixture
def refused(plant):
    """Asserts that a text is refused with a message, and that the plant is as it was."""

    def check(text, kind, message):
        with pytest.raises(ParseError, match=message):
            Parser(plant).AddModelsFromString(text, kind)
        assert plant.num_bodies() == 1 and plant.num_model_instances() == 2

    return check
