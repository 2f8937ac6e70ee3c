"""A scene of 50 objects built by calls, from strings and with parameters set."""

from pydrake.all import (
    AddContactMaterial,
    AddMultibodyPlant,
    Box,
    CalcVolume,
    CoulombFriction,
    DiagramBuilder,
    MultibodyPlantConfig,
    Parser,
    ProximityProperties,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    SpatialInertia,
    Sphere,
)

SDF = """<sdf version="1.7"><model name="thing"><link name="body"><inertial>
<mass>0.5</mass><inertia>
<ixx>0.001</ixx><iyy>0.001</iyy><izz>0.001</izz>
<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
<collision name="c"><geometry><box><size>0.05 0.05 0.1</size></box></geometry></collision>
<visual name="v"><geometry><box><size>0.05 0.05 0.1</size></box></geometry></visual></link></model></sdf>"""


def program():
    builder = DiagramBuilder()
    plant, sg = AddMultibodyPlant(MultibodyPlantConfig(time_step=0.002), builder)
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform([0, 0, -0.5]), Box(10, 10, 1), "ground", CoulombFriction(0.5, 0.5)
    )
    models = []
    for _ in range(25):
        models += parser.AddModelsFromString(SDF, "sdf")
    for k in range(25):
        inst = plant.AddModelInstance(f"ball{k}")
        b = plant.AddRigidBody("ball", inst, SpatialInertia.SolidSphereWithMass(0.3, 0.04))
        props = ProximityProperties()
        AddContactMaterial(dissipation=1.0, friction=CoulombFriction(0.6, 0.6), properties=props)
        plant.RegisterCollisionGeometry(b, RigidTransform(), Sphere(0.04), "c", props)
        plant.RegisterVisualGeometry(b, RigidTransform(), Sphere(0.04), "v", [0.5, 0.5, 0.5, 1])
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    pc = plant.GetMyMutableContextFromRoot(context)
    for k, i in enumerate(plant.GetFloatingBaseBodies()):
        body = plant.get_body(i)
        plant.SetFreeBodyPose(
            pc, body, RigidTransform(RollPitchYaw(0.1 * k, 0, 0.2), [0.2 * (k % 7), 0.2 * (k // 7), 0.1])
        )
        body.SetMass(pc, 0.4)
    for i in plant.GetBodyIndices(models[0]):
        plant.get_body(i).SetSpatialInertiaInBodyFrame(pc, SpatialInertia.SolidBoxWithMass(1, 0.05, 0.05, 0.1))
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    simulator.AdvanceTo(0.02)
    insp = sg.model_inspector()
    [insp.GetName(g) for g in insp.GetAllGeometryIds()]
    [insp.GetName(f) for f in insp.GetAllFrameIds()]
    vol = sum(CalcVolume(insp.GetShape(g)) for g in insp.GetAllGeometryIds())
    return plant.GetPositions(pc).sum(), vol


for _ in range(3):
    program()
