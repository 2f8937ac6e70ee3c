import pytest

from sheldrake.common.value import Value
from sheldrake.systems.primitives import PassThrough


@pytest.mark.parametrize("model", [2, [1.0, 2.0], Value("a")], ids=["size", "value", "abstract"])
def test_an_input_that_is_required_is_missed(model):
    system = PassThrough(model, input_required=True)
    assert system.input_required() and not PassThrough(model).input_required()
    context = system.CreateDefaultContext()
    with pytest.raises(RuntimeError, match="is not connected"):
        system.get_output_port().Eval(context)
    default = PassThrough(model)
    default.get_output_port().Eval(default.CreateDefaultContext())


def test_conversion_keeps_what_is_required():
    assert PassThrough(1, True).ToAutoDiffXd().input_required()
    assert not PassThrough(1).ToSymbolic().input_required()
