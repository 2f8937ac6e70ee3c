"""Random nested multi-rate diagrams."""

from tests.unit.systems.framework.oracle import read

from sheldrake.systems import primitives as pr
from sheldrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem

PERIODS = [0.01, 0.02, 0.01005, 0.03, 0.005, 1 / 300, 0.1]


class PythonFilter(LeafSystem):
    """What a user writes: two groups of discrete state, an output with feedthrough, a continuous state."""

    def __init__(self, period, offset, kind):
        super().__init__()
        self.DeclareVectorInputPort("u", 2)
        self.DeclareDiscreteState([0.5, -0.25])
        self.DeclareDiscreteState([1.0])
        self.DeclareContinuousState(1)
        self.DeclareVectorOutputPort("y", 2, self.calc)
        if kind == "discrete":
            self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self.update)
        else:
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self.update_all)
        self.DeclarePerStepDiscreteUpdateEvent(self.count)

    def calc(self, context, y):
        x = context.get_discrete_state(0).value()
        y.SetFromVector(x - 0.25 * read(self, context, 0) + context.get_discrete_state(1)[0])

    def update(self, context, x_next):
        x, u = context.get_discrete_state(0).value(), read(self, context, 0)
        x_next.get_mutable_vector(0)[1] = 0.5 * x[0] + 0.125 * u[1] + context.get_time()

    def update_all(self, context, state):
        x, u = context.get_discrete_state(0).value(), read(self, context, 0)
        state.get_mutable_discrete_state(0)[1] = 0.5 * x[0] + 0.25 * u[0] - context.get_time()

    def count(self, context, x_next):
        x_next.get_mutable_vector(1)[0] = 0.75 * context.get_discrete_state(1)[0] + 0.01

    def DoCalcTimeDerivatives(self, context, derivatives):
        derivatives[0] = read(self, context, 0)[1] - context.get_continuous_state_vector()[0]


class PythonGain(LeafSystem):
    """A function of its input alone, and says so."""

    def __init__(self):
        super().__init__()
        port = self.DeclareVectorInputPort("u", 2)
        self.DeclareVectorOutputPort("y", BasicVector(2), self.calc, {port.ticket()})

    def calc(self, context, y):
        y.SetFromVector(-0.75 * read(self, context, 0))


def random_leaf(g):
    period, offset = g.choice(PERIODS), g.choice([0.0, 0.0, 0.01, 0.005])
    A, B = g.uniform(-0.4, 0.4, (2, 2)), g.uniform(-1, 1, (2, 2))
    C, D = g.uniform(-1, 1, (2, 2)), g.uniform(-1, 1, (2, 2)) * g.integers(2)
    kind = ("discrete", "unrestricted")[g.integers(2)]
    choices = [
        lambda: pr.Gain(g.uniform(-1, 1, 2)),
        lambda: pr.Gain(g.uniform(-1, 1, 1)),
        lambda: pr.Adder(int(g.integers(1, 4)), 2),
        lambda: pr.Adder(2, 1),
        lambda: pr.ZeroOrderHold(period, 2, offset),
        lambda: pr.ZeroOrderHold(period, 1, offset),
        lambda: pr.Integrator(g.normal(size=2)),
        lambda: pr.FirstOrderLowPassFilter(g.uniform(0.1, 1), 2),
        lambda: pr.LinearSystem(A, B, C, D, period),
        lambda: pr.AffineSystem(A, B, A[0], C, D, B[0]),
        lambda: pr.DiscreteTimeDelay(period, int(g.integers(1, 4)), 2),
        lambda: PythonFilter(period, offset, kind),
        PythonGain,
        lambda: pr.VectorLogSink(2),
        lambda: pr.VectorLogSink(1),
        lambda: pr.VectorLogSink(2, period),
        lambda: pr.Multiplexer([1, 1]),
        lambda: pr.Demultiplexer(2),
    ]
    return choices[g.integers(len(choices))]()


def random_diagram(g, depth=2):
    """Inputs with feedthrough listen to earlier systems only, the others to any; what stays open is exported."""
    b = DiagramBuilder()
    wave = pr.Sine(1.0, g.uniform(0.2, 30), 0.1, 2)
    systems = [b.AddSystem(s) for s in (pr.ConstantVectorSource([g.normal()]), wave)]
    for _ in range(g.integers(4, 12)):
        nested = depth and g.random() < 0.25
        systems.append(b.AddSystem(random_diagram(g, depth - 1) if nested else random_leaf(g)))
    for n, s in enumerate(systems):
        free = isinstance(s, LeafSystem) and not s.HasAnyDirectFeedthrough()
        for i in range(s.num_input_ports()):
            port = s.get_input_port(i)
            known = systems if free else systems[:n]
            outputs = [q.get_output_port(j) for q in known for j in range(q.num_output_ports())]
            sources = [o for o in outputs if o.size() == port.size()]
            if g.random() < 0.15:
                b.ExportInput(port, f"in{n}_{i}")
            else:
                b.Connect(sources[g.integers(len(sources))], port)
        for j in range(s.num_output_ports()):
            b.ExportOutput(s.get_output_port(j))
    return b.Build()
