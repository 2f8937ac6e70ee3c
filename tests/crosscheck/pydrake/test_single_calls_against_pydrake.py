"""Legal but unusual calls: solvers of one's own, copies that are changed, contexts of another system, keywords."""

from __future__ import annotations

import importlib
import re

import numpy as np
import pytest

pytest.importorskip("pydrake")

from all_systems import ARM, Library, arm

pytestmark = pytest.mark.peer
LIBRARIES = [Library("sheldrake"), Library("pydrake")]
EYE = np.eye(2)


def numbers(x):
    """Values and derivatives, or texts of expressions."""
    return [(a.value(), a.derivatives().tolist()) if hasattr(a, "derivatives") else str(a) for a in np.ravel(x)]


def default_state(system):
    context = system.CreateDefaultContext()
    continuous = context.num_continuous_states() > 0
    return (context.get_continuous_state_vector() if continuous else context.get_discrete_state_vector()).CopyToVector()


# ---- solvers of one's own


def own_solver(lib, calls):
    class Own(lib.SolverInterface):
        def __init__(self):
            lib.SolverInterface.__init__(self)

        def solver_id(self):
            return lib.SolverId("own")

        def Solve(self, prog, initial_guess, solver_options, result):
            calls.append([type(x).__name__ for x in (prog, initial_guess, solver_options, result)])
            lib.ClarabelSolver().Solve(prog, initial_guess, solver_options, result)

    return Own()


def small_program(lib):
    prog = lib.MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddBoundingBoxConstraint(0.5, 1.0, x)
    prog.AddLinearCost(x[0] + x[1])
    return prog


def test_a_solver_of_ones_own():
    found = []
    for lib in LIBRARIES:
        calls = []
        solver, prog, filled = own_solver(lib, calls), small_program(lib), lib.MathematicalProgramResult()
        solver.Solve(prog, None, None, filled)
        made = lib.SolverInterface.Solve(solver, prog)
        with pytest.raises(TypeError):
            solver.Solve(prog)
        optima = [round(result.get_optimal_cost(), 6) for result in (filled, made)]
        found.append([solver.SolverName(), solver.solver_type(), made.is_success(), optima, calls])
    assert found[0] == found[1]


@pytest.mark.parametrize("call", ["available", "enabled", "solver_id", "SolverName", "solver_type"])
def test_what_a_solver_must_override(call):
    for lib in LIBRARIES:
        with pytest.raises(RuntimeError, match="pure virtual function"):
            getattr(lib.SolverInterface(), call)()
        with pytest.raises(RuntimeError, match="pure virtual function"):
            lib.SolverInterface().Solve(small_program(lib))


def test_a_graph_is_solved_by_a_solver_of_ones_own():
    """pydrake cannot keep it in the options."""
    lib, calls = LIBRARIES[0], []
    graph = lib.GraphOfConvexSets()
    u, v = graph.AddVertex(lib.Point([0.0, 0.0])), graph.AddVertex(lib.HPolyhedron.MakeUnitBox(2))
    edge = graph.AddEdge(u, v)
    options = lib.GraphOfConvexSetsOptions()
    options.solver = own_solver(lib, calls)
    assert graph.SolveConvexRestriction([edge], options).is_success() and len(calls) == 1


# ---- copies


def affine(lib, period):
    return lib.AffineSystem(EYE, EYE, np.zeros(2), EYE, EYE, np.zeros(2), period)


def affine_in_time(lib, period):
    constant, zero = lib.PiecewisePolynomial(EYE), lib.PiecewisePolynomial(np.zeros((2, 1)))
    return lib.TrajectoryAffineSystem(constant, constant, zero, constant, constant, zero, period)


@pytest.mark.parametrize("kind", [affine, affine_in_time])
@pytest.mark.parametrize("period", [0.0, 0.1])
def test_default_states_on_other_scalars(kind, period):
    """They keep derivatives and variables, and are no business of the system that was converted."""
    found = []
    for lib in LIBRARIES:
        system = kind(lib, period)
        system.configure_default_state([1.0, 2.0])
        converted, dual = system.ToAutoDiffXd(), lib.AutoDiffXd(3.0, [1.0, 0.5])
        states = []
        for x0 in ([dual, dual], [5.0, 6.0]):
            converted.configure_default_state(x0)
            states.append(numbers(default_state(converted)))
        if kind is affine:
            symbolic, x = system.ToSymbolic(), lib.Variable("x")
            symbolic.configure_default_state([lib.Expression(x), x + 1.0])
            states.append(numbers(default_state(symbolic)))
        with pytest.raises(TypeError):
            system.configure_default_state([dual, dual])
        found.append([states, default_state(system).tolist()])
    assert found[0] == found[1] and found[0][1] == [1.0, 2.0]


def wrapped(system):
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [1.5])
    return system.get_output_port().Eval(context).tolist()


CHANGES = {
    "coefficients": (
        lambda lib: affine(lib, 0.0),
        lambda s: s.UpdateCoefficients(2 * EYE, EYE, np.zeros(2), EYE, EYE, np.zeros(2)),
        lambda s: s.A().tolist(),
    ),
    "integral": (
        lambda lib: lib.Integrator(2),
        lambda s: s.set_default_integral_value([1.0, 2.0]),
        lambda s: [float(str(x).partition("{")[2].partition(",")[0] or x) for x in default_state(s)],
    ),
    "interval": (lambda lib: lib.WrapToSystem(1), lambda s: s.set_interval(0, 0.0, 1.0), wrapped),
}


@pytest.mark.parametrize("what", CHANGES)
@pytest.mark.parametrize("copied", ["Clone", "ToAutoDiffXd", "ToSymbolic"])
def test_a_copy_that_is_changed_leaves_the_original_alone(what, copied):
    make, change, look = CHANGES[what]
    for lib in LIBRARIES[:1] if what == "interval" else LIBRARIES:  # pydrake cannot copy a WrapToSystem
        system = make(lib)
        before, copy_ = look(system), getattr(system, copied)()
        change(copy_)
        assert look(system) == before
        change(system)
        assert look(system) != before


# ---- contexts of another system


def camera(lib):
    core = lib.RenderCameraCore("r", lib.CameraInfo(8, 6, 0.7), lib.ClippingRange(0.1, 9.0), lib.RigidTransform())
    return lib.RgbdSensor(
        lib.SceneGraph.world_frame_id(), lib.RigidTransform(), lib.DepthRenderCamera(core, lib.DepthRange(0.2, 5.0))
    )


OF_ANOTHER = {
    "renderers": lambda lib, c: lib.SceneGraph().RendererCount(c),
    "has renderer": lambda lib, c: lib.SceneGraph().HasRenderer(c, "a"),
    "add renderer": lambda lib, c: lib.SceneGraph().AddRenderer(
        c, "a", lib.MakeRenderEngineVtk(lib.RenderEngineVtkParams())
    ),
    "filter": lambda lib, c: lib.SceneGraph().collision_filter_manager(c),
    "configuration": lambda lib, c: lib.SceneGraph().get_config(c),
    "color camera": lambda lib, c: camera(lib).GetColorRenderCamera(c),
    "parent": lambda lib, c: camera(lib).GetParentFrameId(c),
    "mass matrix": lambda lib, c: lib.examples.AcrobotPlant().MassMatrix(c),
    "bias": lambda lib, c: lib.examples.AcrobotPlant().DynamicsBiasTerm(c),
    "parameters": lambda lib, c: lib.examples.PendulumPlant().get_mutable_parameters(c),
    "state": lambda lib, c: lib.examples.PendulumPlant.get_mutable_state(c),
}


@pytest.mark.parametrize("what", OF_ANOTHER)
def test_a_context_of_another_system_is_refused(what):
    for lib in LIBRARIES:
        plant = arm(lib, 0.01)
        with pytest.raises(RuntimeError):
            OF_ANOTHER[what](lib, plant.CreateDefaultContext())


# ---- keywords, sizes and what has no value


def product_of_sets(lib):
    A, b = np.diag([1.0, 2.0]), np.array([0.0, 1.0])
    box = lib.HPolyhedron.MakeUnitBox(2)
    made = [
        lib.CartesianProduct(sets=[box], A=A, b=b),
        lib.CartesianProduct([box], A=A, b=b),
        lib.CartesianProduct([box], A, b),
    ]
    return [[s.A().tolist(), s.b().tolist(), s.PointInSet([0.9, 0.0]), s.PointInSet([0.9, 0.1])] for s in made]


def boxes_of_duals(lib):
    found = []
    for scalar in ("AutoDiffXd", "Expression"):
        builder = lib.DiagramBuilder()
        plant, graph = lib.AddMultibodyPlantSceneGraph(builder, 0.01)
        lib.Parser(plant).AddModelsFromString(ARM, "urdf")
        ball = plant.RegisterCollisionGeometry(
            plant.GetBodyByName("l1"), lib.RigidTransform([1.0, 0.0, 0.0]), lib.Sphere(0.5), "s", lib.CoulombFriction()
        )
        plant.Finalize()
        diagram = builder.Build().ToAutoDiffXd() if scalar == "AutoDiffXd" else builder.Build().ToSymbolic()
        graph = diagram.GetSubsystemByName(graph.get_name())
        context = graph.GetMyContextFromRoot(diagram.CreateDefaultContext())
        box = graph.get_query_output_port().Eval(context).ComputeObbInWorld(ball)
        found.append([box.pose().GetAsMatrix4().tolist(), box.half_width().round(12).tolist()])
    return found


def threads_of_parameterizations(lib):
    x = lib.Variable("x")
    made = (
        lib.IrisParameterizationFunction(),
        lib.IrisParameterizationFunction(lambda q: q, 1),
        lib.IrisParameterizationFunction([x * x], [x]),
    )
    return [function.get_parameterization_is_threadsafe() for function in made]


def value_by_name(lib):
    value = lib.Value[lib.BasicVector](lib.BasicVector([1.0, 2.0]))
    value.set_value(value=np.array([3.0, 4.0]))
    return value.get_value().CopyToVector().tolist()


def interval_without_length(lib):
    return str(lib.wrap_to(0.3, 0.5, 0.5))


@pytest.mark.parametrize(
    "answer",
    [product_of_sets, boxes_of_duals, threads_of_parameterizations, value_by_name, interval_without_length],
    ids=lambda a: a.__name__,
)
def test_answer_is_the_same(answer):
    assert answer(LIBRARIES[0]) == answer(LIBRARIES[1])


def spectrahedron_with_a_cost(lib):
    prog = small_program(lib)
    prog.AddQuadraticCost(prog.decision_variables()[0] ** 2)
    lib.Spectrahedron(prog)


def mean_of_other_rows(lib):
    prog = lib.MathematicalProgram()
    prog.AddMaximizeGeometricMeanCost(EYE, np.zeros(3), prog.NewContinuousVariables(2))


def one_geometry(lib):
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.01)
    lib.Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.Finalize()
    diagram = builder.Build()
    context = plant.GetMyContextFromRoot(diagram.CreateDefaultContext())
    importlib.import_module(f"{lib.package}.multibody.inverse_kinematics").DistanceConstraint(
        plant, (lib.GeometryId.get_new_id(),), context, 0.1, 0.2
    )


def sets_and_more(lib):
    lib.Intersection(sets=[lib.HPolyhedron.MakeUnitBox(2)], oops=3)


@pytest.mark.parametrize(
    ("call", "kind", "words"),
    [
        (spectrahedron_with_a_cost, RuntimeError, "does not support.*QuadraticCost"),
        (mean_of_other_rows, ValueError, "consistent size"),
        (one_geometry, TypeError, "incompatible constructor arguments"),
        (sets_and_more, TypeError, "incompatible constructor arguments"),
    ],
    ids=lambda a: getattr(a, "__name__", None),
)
def test_refusal_is_the_same(call, kind, words):
    for lib in LIBRARIES:
        with pytest.raises(kind, match=re.compile(words, re.DOTALL)):
            call(lib)


# ---- numbers in arrays without dimensions, columns, arrays to be written


HALF = np.array(0.5)


def described(value):
    """Its type and number, or text."""
    return type(value).__name__.partition("_")[0], str(value)


def numbers_without_dimensions(lib):
    x = lib.Variable("x")
    e = lib.Expression(x) + 1
    found = [getattr(lib, name)(HALF) for name in ("sin", "sqrt", "abs", "floor", "isnan")]
    found += [lib.max(HALF, 0.3), lib.atan2(0.3, HALF), lib.pow(HALF, 2), lib.Expression(HALF), e + HALF, e == HALF]
    found += [
        e < HALF,
        e.Evaluate({x: HALF}),
        importlib.import_module(f"{lib.package}.symbolic").Polynomial(x).Evaluate({x: HALF}),
    ]
    return [*map(described, found), lib.Parallelism(np.bool_(False)).num_threads()]


def cones_of_columns(lib):
    prog = lib.MathematicalProgram()
    column = np.array([[lib.Expression(v)] for v in prog.NewContinuousVariables(3)])
    adds = (
        prog.AddExponentialConeConstraint, prog.AddLorentzConeConstraint, prog.AddRotatedLorentzConeConstraint
    )  # fmt: skip
    return [add(column).evaluator().num_vars() for add in adds]


def threads_of_options(lib):
    options = [lib.GraphOfConvexSetsOptions(), lib.FindSeparationCertificateOptions()]
    for each in options:
        each.parallelism = False
    return [each.parallelism.num_threads() for each in options]


def values_of_whole_numbers(lib):
    prog = small_program(lib)
    cost = prog.linear_costs()[0]
    values = prog.GetBindingVariableValues(cost, np.array([1, 2]))
    return str(values.dtype), values.tolist(), lib.Intersection(np.array([lib.Point([1.0])])).num_elements()


@pytest.mark.parametrize(
    "answer",
    [numbers_without_dimensions, cones_of_columns, threads_of_options, values_of_whole_numbers],
    ids=lambda a: a.__name__,
)
def test_answer_to_odd_arguments_is_the_same(answer):
    assert answer(LIBRARIES[0]) == answer(LIBRARIES[1])


@pytest.mark.parametrize("array", [np.zeros(1, dtype=int), np.zeros(1, dtype=np.float32), "read-only"])
def test_arrays_that_cannot_hold_what_is_written_are_refused(array):
    """Fractions would be lost."""
    if isinstance(array, str):
        array = np.zeros(1)
        array.setflags(write=False)
    for lib in LIBRARIES:
        plant = arm(lib)
        instance = plant.GetModelInstanceByName("arm")
        network = lib.MultilayerPerceptron([1, 1])
        context = network.CreateDefaultContext()
        for call, *args in (
            (plant.SetPositionsInArray, instance, [0.5], array),
            (plant.SetVelocitiesInArray, instance, [0.5], array),
            (plant.SetActuationInArray, instance, [0.5], array),
            (network.BatchOutput, context, np.ones((1, 1)), array.reshape(1, 1)),
        ):
            with pytest.raises(TypeError, match="incompatible function arguments"):
                call(*args)
        assert array.tolist() == [0.0]


def integrator_of_a_part(lib):
    """With the context of a plant in a diagram, and a time step of another kind of float."""
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.01)
    lib.Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    diagram = builder.Build()
    context = plant.GetMyContextFromRoot(diagram.CreateDefaultContext())
    plant.SetPositions(context, [0.25])
    module = importlib.import_module(f"{lib.package}.multibody.inverse_kinematics")
    integrator = module.DifferentialInverseKinematicsIntegrator(
        plant,
        plant.GetFrameByName("l1"),
        np.float32(0.5),
        module.DifferentialInverseKinematicsParameters(1, 1),
        robot_context=context,
    )
    found = integrator.CreateDefaultContext()
    integrator.ExecuteInitializationEvents(found)
    return found.get_discrete_state(0).value().tolist()


def test_integrator_of_a_plant_in_a_diagram():
    assert integrator_of_a_part(LIBRARIES[0]) == integrator_of_a_part(LIBRARIES[1]) == [0.0]


def test_directives_for_model_instances_that_exist():
    """A number goes behind the name where the parser renames; it is an error otherwise."""
    found = []
    for lib in LIBRARIES:
        parsing = importlib.import_module(f"{lib.package}.multibody.parsing")
        directives = parsing.LoadModelDirectivesFromString("directives:\n- add_model_instance: {name: foo}\n")
        plant = lib.MultibodyPlant(0.0)
        parser = lib.Parser(plant)
        parsing.ProcessModelDirectives(directives, parser)
        with pytest.raises(RuntimeError, match=r"already .*a model instance named 'foo'"):
            parsing.ProcessModelDirectives(directives, parser)
        parser.SetAutoRenaming(True)
        for _ in range(2):
            parsing.ProcessModelDirectives(directives, parser)
        found.append([plant.GetModelInstanceName(lib.ModelInstanceIndex(i)) for i in range(2, 5)])
    assert found[0] == found[1] == ["foo", "foo_1", "foo_2"]


def pose_of_a_free_body(lib, wrong):
    plant = lib.MultibodyPlant(0.0)
    body = plant.AddRigidBody("b", lib.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.SetDefaultFloatingBaseBodyPose(body, wrong)


OF_WRONG_CLASSES = {
    "controllability": lambda lib, wrong: lib.IsControllable(wrong),
    "observability": lambda lib, wrong: lib.ObservabilityMatrix(wrong),
    "detectability": lambda lib, wrong: lib.IsDetectable(sys=wrong),
    "settings of a simulator": lambda lib, wrong: lib.ExtractSimulatorConfig(wrong),
    "settings": lambda lib, wrong: lib.ApplySimulatorConfig(wrong, lib.Simulator(lib.Adder(1, 1))),
    "pose": pose_of_a_free_body,
    "status": lambda lib, wrong: lib.EventStatus.DidNothing().KeepMoreSevere(wrong),
    "system": lambda lib, wrong: lib.DiagramBuilder().AddNamedSystem("x", wrong),
    "geometry": lambda lib, wrong: lib.SceneGraph().RenameGeometry(wrong, "x"),
    "scoped name": lambda lib, wrong: lib.ScopedName.Parse(wrong),
}


@pytest.mark.parametrize("what", OF_WRONG_CLASSES)
@pytest.mark.parametrize("wrong", [3, [1.0], {}], ids=str)
def test_wrong_classes_are_type_errors(what, wrong):
    for lib in LIBRARIES:
        with pytest.raises(TypeError, match="incompatible"):
            OF_WRONG_CLASSES[what](lib, wrong)


SETTINGS = {
    "GraphOfConvexSetsOptions": ["solver", "restriction_solver", "preprocessing_solver", "parallelism"],
    "IrisOptions": ["prog_with_additional_constraints", "solver_options"],
    "IrisNp2Options": ["sampled_iris_options", "ray_sampler_options", "parameterization", "solver", "solver_options"],
    "CommonSampledIrisOptions": ["parallelism", "prog_with_additional_constraints"],
    "IrisZoOptions": ["sampled_iris_options", "parameterization"],
    "IrisFromCliqueCoverOptions": ["parallelism"],
}


def which_are_taken(lib, options, name):
    """Of values of many classes, the names of those that the setting takes."""
    values = (
        None, 3, "x", True, lib.ClarabelSolver(), lib.ClarabelSolver, lib.SolverOptions(), lib.MathematicalProgram(),
        lib.Parallelism(1), lib.CommonSampledIrisOptions(), lib.RaySamplerOptions(), lib.IrisParameterizationFunction(),
    )  # fmt: skip
    taken = []
    for value in values:
        try:
            setattr(getattr(lib, options)(), name, value)
        except TypeError:
            continue
        taken.append(type(value).__name__)
    return taken


@pytest.mark.parametrize(("options", "name"), [(options, name) for options in SETTINGS for name in SETTINGS[options]])
def test_settings_take_values_of_the_same_classes(options, name):
    ours, theirs = (which_are_taken(lib, options, name) for lib in LIBRARIES)
    assert ours == theirs and 0 < len(ours) < 4


# ---- arguments of another kind


def arm_constraint(lib, plant, context, angle=0.1):
    frame = lib.MultibodyPlant(0.0).world_frame()
    return lib.AngleBetweenVectorsConstraint(plant, frame, [1, 0, 0], frame, [1, 0, 0], 0.0, angle, context)


OTHER_KINDS = {
    "discrete time": lambda lib: lib.DiscreteTimeApproximation("zz", 0.1),
    "batch": lambda lib: lib.BatchEvalTimeDerivatives(3, None, [0.0], np.zeros((0, 1)), np.zeros((0, 1))),
    "integrator": lambda lib: lib.ResetIntegratorFromFlags("zz", "runge_kutta3", 0.1),
    "friction": lambda lib: lib.CalcContactFrictionFromSurfaceProperties(3, lib.CoulombFriction(1.0, 1.0)),
    "scoped frame": lambda lib: lib.GetScopedFrameByName(3, "l1"),
    "subspace": lambda lib: lib.AffineSubspace(np.eye(2), [1.0, 2.0]).ContainedIn("zz"),
    "shooting": lambda lib: lib.DirectCollocation("zz", None, 3, 0.1, 0.2),
    "entry": lambda lib: lib.L1NormCost(np.eye(2), [1.0, 2.0]).update_A_entry("zz", 0, 0.3),
    "constraint": lambda lib: arm_constraint(lib, 3, lib.Integrator(1).CreateDefaultContext()),
    "box": lambda lib: lib.Aabb([0, 0, 0], [1, 1, 1]).Equal(3),
    "constructor of a system": lambda lib: lib.Accelerometer("zz", lib.RigidTransform()),
    "own class": lambda lib: lib.MonteCarloSimulation(3, None, 1.0, 1),
}


@pytest.mark.parametrize("kind", OTHER_KINDS)
def test_another_class_is_a_type_error(kind):
    for lib in LIBRARIES:
        with pytest.raises(TypeError):
            OTHER_KINDS[kind](lib)


STATED = {
    "no plant": (ValueError, lambda lib: arm_constraint(lib, None, None)),
    "mean": (ValueError, lambda lib: (p := lib.MathematicalProgram()).AddMaximizeGeometricMeanCost(
        p.NewContinuousVariables(2), -1.0
    )),
    "scheme": (RuntimeError, lambda lib: lib.ResetIntegratorFromFlags(
        lib.Simulator(lib.Integrator(1)), "none", 0.1
    )),
    "variable": (RuntimeError, lambda lib: lib.DirectTranscription(
        s := lib.Integrator(1), s.CreateDefaultContext(), 3, lib.DirectTranscription.TimeStep(0.1)
    ).AddRunningCost(lib.Variable("x"))),
}  # fmt: skip


@pytest.mark.parametrize("kind", STATED)
def test_what_is_said_of_arguments_of_the_right_kind_stays(kind):
    error, call = STATED[kind]
    for lib in LIBRARIES:
        with pytest.raises(error):
            call(lib)


EVENTS = {
    "none": lambda s: None,
    "each step": lambda s: s.DeclarePerStepDiscreteUpdateEvent(lambda c, d: None),
    "of all state, each step": lambda s: s.DeclarePerStepUnrestrictedUpdateEvent(lambda c, d: None),
    "of all state, periodic": lambda s: s.DeclarePeriodicUnrestrictedUpdateEvent(0.1, 0.0, lambda c, d: None),
    "of all state, forced": lambda s: s.DeclareForcedUnrestrictedUpdateEvent(lambda c, d: None),
    "second period": lambda s: s.DeclarePeriodicDiscreteUpdateEvent(0.2, 0.0, lambda c, d: None),
}


@pytest.mark.parametrize("events", EVENTS)
def test_difference_equations_with_other_events(events):
    found = []
    for lib in LIBRARIES:

        class Own(lib.LeafSystem):
            def __init__(self):
                super().__init__()
                self.DeclareDiscreteState(1)
                self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, lambda c, d: None)
                EVENTS[events](self)

        found.append(Own().IsDifferenceEquationSystem())
    assert found[0] == found[1]
