"""What systems, contexts, values, simulators, blocks, controllers and solvers answer is what pydrake's do, by lines."""

import pathlib

import pytest
from tests.crosscheck.pydrake import lines

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
MODULES = [
    "math", "symbolic", "autodiffutils", "common.value", "common", "systems.framework", "systems.primitives",
    "systems.analysis", "systems.controllers", "systems.estimators", "trajectories", "examples", "solvers",
]  # fmt: skip
SETUP = '''
class L(LeafSystem):
    """One of everything that can be declared."""

    def __init__(self):
        super().__init__()
        self.set_name("leaf")
        self.DeclareVectorInputPort("u", BasicVector([1.0, 2.0]))
        self.DeclareVectorInputPort("v", size=1)
        self.DeclareAbstractInputPort("a", model_value=Value("s"))
        self.DeclareVectorOutputPort("y", BasicVector(2), self.calc)
        self.DeclareAbstractOutputPort("ya", lambda: AbstractValue.Make({"k": 1}), self.calc_a, {self.time_ticket()})
        self.DeclareStateOutputPort("xd", self.DeclareDiscreteState([1.0, 2.0]))
        self.DeclareContinuousState(BasicVector([1.0, 2.0, 3.0, 4.0]), 2, 1, 1)
        self.DeclareNumericParameter(BasicVector([3.0]))
        self.DeclareAbstractParameter(AbstractValue.Make(5))
        self.DeclareAbstractState(AbstractValue.Make([1]))
        self.DeclarePeriodicPublishEvent(0.1, 0.05, self.publish)

    def publish(self, context):
        pass

    def calc(self, context, output):
        output.SetFromVector(self.get_input_port(0).Eval(context) * 2)

    def calc_a(self, context, output):
        output.set_value({"k": context.get_time()})

    def DoCalcTimeDerivatives(self, context, derivatives):
        derivatives.SetFromVector(np.arange(4.0))


def ev(system, *inputs, t=0.0):
    """All outputs of a system with these inputs."""
    context = system.CreateDefaultContext()
    context.SetTime(t)
    for i, value in enumerate(inputs):
        system.get_input_port(i).FixValue(context, value)
    return [system.get_output_port(j).Eval(context) for j in range(system.num_output_ports())]
'''


@pytest.mark.parametrize("name", ["framework", "block", "solver"])
def test_answers_are_the_same(name):
    assert not lines.differences(pathlib.Path(__file__).with_name(f"{name}_lines.txt"), MODULES, SETUP)
