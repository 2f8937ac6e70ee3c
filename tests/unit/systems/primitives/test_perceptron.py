"""A network's output is computed by a kernel, and is NumPy's to round-off; on other scalars it has derivatives."""

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from sheldrake.common import RandomGenerator
from sheldrake.common.kernel import Kernel
from sheldrake.systems.primitives import MultilayerPerceptron, PerceptronActivationType

IDENTITY, RELU, TANH = (getattr(PerceptronActivationType, f"k{name}") for name in ("Identity", "ReLU", "Tanh"))


@pytest.mark.parametrize(
    "arguments",
    [
        ([3, 20, 2], TANH),
        ([4, 16, 16, 3], RELU),
        ([2, 1], IDENTITY),
        ([True, False, True], [5, 7, 1], [RELU, TANH, IDENTITY]),
        ([False, True], [3], [TANH]),
    ],
)
def test_the_output_is_that_of_a_batch(arguments):
    network = MultilayerPerceptron(*arguments)
    assert isinstance(network._outputs[0].calc, Kernel)
    context = network.CreateDefaultContext()
    network.SetRandomContext(context, RandomGenerator(2))
    size, generator = network.get_input_port().size(), np.random.default_rng(3)
    for x in generator.normal(size=(5, size)):
        network.get_input_port().FixValue(context, x)
        found = network.get_output_port().Eval(context)
        np.testing.assert_allclose(found, network.BatchOutput(context, x[:, None])[:, 0], rtol=0, atol=1e-15)
    network.SetBiases(context, 0, network.GetBiases(context, 0) + 1.0)  # parameters are those of the context
    after = network.get_output_port().Eval(context)
    np.testing.assert_allclose(after, network.BatchOutput(context, x[:, None])[:, 0], rtol=0, atol=1e-15)
    dual = network.ToAutoDiffXd()
    own = dual.CreateDefaultContext()
    own.SetTimeStateAndParametersFrom(context)
    dual.get_input_port().FixValue(own, InitializeAutoDiff(x).ravel())
    gradient = ExtractGradient(dual.get_output_port().Eval(own))
    for k in range(size):
        there = [network.BatchOutput(context, (x + s * 1e-6 * np.eye(size)[k])[:, None])[:, 0] for s in (1, -1)]
        np.testing.assert_allclose(gradient[:, k], (there[0] - there[1]) / 2e-6, atol=1e-8)
