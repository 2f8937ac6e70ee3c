import math

import numpy as np
import pytest
from tests.unit.cad import solids

from sheldrake.cad import MakeUrdfFromMesh, UnitsUnsure

RELATIVE = 1e-6  # what is asked; single precision of binary STL leaves about 1e-7


def write(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    return path


def box_inertia(mass, x, y, z):
    return mass / 12.0 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])


def prism_moments(n, radius, height, mass):
    """Inertia of a regular n-gon's prism about its centre: the polygon's polar moment is known in closed form."""
    side = 2.0 * radius * math.sin(math.pi / n)
    apothem = radius * math.cos(math.pi / n)
    square = (apothem**2 + side**2 / 12.0) / 2.0  # mean of x^2 + y^2
    return mass * np.diag([square / 2 + height**2 / 12, square / 2 + height**2 / 12, square])


def check(model, volume, mass, centre, inertia, relative=RELATIVE):
    assert model.volume == pytest.approx(volume, rel=relative)
    assert model.mass == pytest.approx(mass, rel=relative)
    np.testing.assert_allclose(model.p_BoBcm_B, centre, atol=relative * max(np.abs(centre).max(), 1e-3))
    np.testing.assert_allclose(model.I_BBcm_B, inertia, atol=relative * np.abs(inertia).max())


SIDES = np.array([60.0, 40.0, 25.0])


@pytest.mark.parametrize(
    "name, data",
    [
        ("part.stl", solids.binary_stl(*solids.box(*SIDES))),
        ("text.stl", solids.ascii_stl(("part", solids.box(*SIDES)))),
        ("part.obj", solids.obj(*solids.box(*SIDES))),
        ("part.ply", solids.ply(*solids.box(*SIDES))),
        ("part.dae", solids.dae(*solids.box(*SIDES))),
        ("part.3mf", solids.threemf(*solids.box(*SIDES), unit="")),
    ],
)
def test_a_box_in_millimetres_of_every_format(tmp_path, name, data):
    model = MakeUrdfFromMesh(write(tmp_path, name, data), density=1200.0, output=tmp_path / "part.urdf")
    x, y, z = SIDES / 1000.0
    mass = 1200.0 * x * y * z
    check(model, x * y * z, mass, [x / 2, y / 2, z / 2], box_inertia(mass, x, y, z))
    assert model.units[0].unit == "mm" and model.units[0].confidence >= 0.85
    assert not model.warnings


def test_gltf_is_metres_and_y_up(tmp_path):
    import trimesh

    vertices, triangles = solids.box(0.06, 0.04, 0.025)
    y_up = vertices[:, [0, 2, 1]] * [1, 1, -1]
    data = trimesh.Trimesh(y_up, triangles, process=False).export(file_type="glb")
    model = MakeUrdfFromMesh(write(tmp_path, "part.glb", data), mass=0.5, output=tmp_path / "part.urdf")
    check(model, 0.06 * 0.04 * 0.025, 0.5, [0.03, 0.02, 0.0125], box_inertia(0.5, 0.06, 0.04, 0.025))
    assert model.units[0].unit == "m"


def test_a_cylinder(tmp_path):
    n, radius, height = 90, 0.02, 0.05
    data = solids.obj(*solids.extruded(solids.polygon(n, radius), height))
    model = MakeUrdfFromMesh(write(tmp_path, "c.obj", data), mass=2.0, units="m")
    area = n / 2 * radius**2 * math.sin(2 * math.pi / n)
    check(model, area * height, 2.0, [0, 0, height / 2], prism_moments(n, radius, height, 2.0))


def test_a_block_with_a_hole_is_the_block_less_the_plug(tmp_path):
    n, height, density = 64, 0.03, 2700.0
    outer, inner = solids.polygon(n, 0.04), solids.polygon(n, 0.015)
    data = solids.obj(*solids.extruded(outer, height, [inner]))
    model = MakeUrdfFromMesh(write(tmp_path, "ring.obj", data), density=density, units="m")
    areas = [n / 2 * r**2 * math.sin(2 * math.pi / n) for r in (0.04, 0.015)]
    masses = [density * a * height for a in areas]
    inertia = prism_moments(n, 0.04, height, masses[0]) - prism_moments(n, 0.015, height, masses[1])
    check(model, (areas[0] - areas[1]) * height, masses[0] - masses[1], [0, 0, height / 2], inertia)


def test_the_two_hole_block_in_two_units(tmp_path):
    """The project's own block: the exact volume is that of its mesh, whatever unit and format it comes in."""
    import sheldrake
    from sheldrake.geometry import ReadObjToTriangleSurfaceMesh
    from sheldrake.geometry._meshes.mass_properties import of_triangles

    mesh = ReadObjToTriangleSurfaceMesh(sheldrake.model_path("two_hole_block/two_hole_block.obj"))
    exact = of_triangles(mesh._vertices, mesh._triangles)
    scale = 1.0 if np.ptp(mesh._vertices) < 1.0 else 1e-3
    for unit, factor in (("mm", 1e-3), ("in", 0.0254), ("m", 1.0)):
        data = solids.binary_stl(mesh._vertices * (scale / factor), mesh._triangles)
        model = MakeUrdfFromMesh(write(tmp_path, f"{unit}.stl", data), density=1.0, units=unit)
        assert model.volume == pytest.approx(exact.volume * scale**3, rel=RELATIVE)
        np.testing.assert_allclose(
            model.I_BBcm_B, exact.I_GGcm * scale**5, atol=RELATIVE * exact.I_GGcm.max() * scale**5
        )


def test_a_hollow_weighs_nothing(tmp_path):
    vertices, triangles = solids.box(0.1, 0.1, 0.1)
    inner, inside = solids.box(0.04, 0.04, 0.04)
    both = np.concatenate([vertices, inner + 0.03]), np.concatenate([triangles, inside[:, ::-1] + len(vertices)])
    model = MakeUrdfFromMesh(write(tmp_path, "h.obj", solids.obj(*both)), density=1000.0, units="m")
    mass, hole = 1.0, 0.064
    inertia = box_inertia(mass, 0.1, 0.1, 0.1) - box_inertia(hole, 0.04, 0.04, 0.04)
    check(model, 1e-3 - 0.04**3, mass - hole, [0.05] * 3, inertia)
    assert any("hollow" in note for note in model.notes) and len(model.solids) == 1


def test_two_solids_are_said_and_make_one_body(tmp_path):
    first, second = solids.box(20.0, 20.0, 20.0), solids.box(20.0, 20.0, 20.0)
    second = second[0] + [100.0, 0.0, 0.0], second[1]
    data = solids.ascii_stl(("left", first), ("right", second))
    model = MakeUrdfFromMesh(write(tmp_path, "two.stl", data), mass=1.0, units="mm", output=tmp_path / "two.urdf")
    assert model.solids == ["left", "right"]
    assert any("2 separate solids (left, right)" in note for note in model.notes)
    inertia = 2.0 * box_inertia(0.5, 0.02, 0.02, 0.02) + 2.0 * 0.5 * 0.05**2 * np.diag([0.0, 1.0, 1.0])
    check(model, 2 * 8e-6, 1.0, [0.06, 0.01, 0.01], inertia)


def test_several_files_make_one_body(tmp_path):
    a = write(tmp_path, "a.stl", solids.binary_stl(*solids.box(20.0, 20.0, 20.0)))
    vertices, triangles = solids.box(20.0, 20.0, 20.0)
    b = write(tmp_path, "b.obj", solids.obj(vertices + np.array([100.0, 0.0, 0.0]), triangles))
    model = MakeUrdfFromMesh([a, b], mass=1.0, units="mm", output=tmp_path / "ab.urdf")
    np.testing.assert_allclose(model.p_BoBcm_B, [0.06, 0.01, 0.01], rtol=1e-6)
    assert model.urdf.count("<visual>") == 2 and model.files == [tmp_path / "a.obj"]


def test_wrong_windings_and_holes_are_repaired_and_said(tmp_path):
    vertices, triangles = solids.box(*SIDES / 1000.0)
    exact = MakeUrdfFromMesh(write(tmp_path, "good.obj", solids.obj(vertices, triangles)), mass=1.0, units="m")

    turned = triangles.copy()
    turned[3] = turned[3][::-1]
    model = MakeUrdfFromMesh(write(tmp_path, "turned.obj", solids.obj(vertices, turned)), mass=1.0, units="m")
    np.testing.assert_allclose(model.I_BBcm_B, exact.I_BBcm_B, rtol=1e-12, atol=1e-18)
    assert any("turned 1 triangles" in note for note in model.notes)

    model = MakeUrdfFromMesh(write(tmp_path, "in.obj", solids.obj(vertices, triangles[:, ::-1])), mass=1.0, units="m")
    np.testing.assert_allclose(model.I_BBcm_B, exact.I_BBcm_B, rtol=1e-12, atol=1e-18)
    assert any("inside out" in note for note in model.notes)

    lid = [t for t in triangles if (vertices[t][:, 2] > 0.024).all()]
    open_box = np.array([t for t in triangles if not any((t == u).all() for u in lid)])
    path = write(tmp_path, "open.stl", solids.binary_stl(vertices, open_box))
    model = MakeUrdfFromMesh(path, mass=1.0, units="m", output=tmp_path / "open.urdf")
    check(model, exact.volume, 1.0, exact.p_BoBcm_B, exact.I_BBcm_B)
    assert any("closed a hole with 4 edges" in note for note in model.notes) and not model.warnings


def test_a_bent_hole_is_a_guess_and_a_sheet_is_no_solid(tmp_path):
    vertices, triangles = solids.box(0.1, 0.1, 0.1)
    corner = [t for t in triangles if 2 not in t]
    model = MakeUrdfFromMesh(write(tmp_path, "bent.obj", solids.obj(vertices, np.array(corner))), mass=1.0, units="m")
    assert any("guess" in warning for warning in model.warnings)
    sheet = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    with pytest.raises(ValueError, match="solid"):
        MakeUrdfFromMesh(write(tmp_path, "sheet.obj", solids.obj(*sheet)), mass=1.0, units="m")


# Units.


def test_inches_are_known_by_their_round_numbers(tmp_path):
    sides = np.array([3.0, 2.125, 0.75])
    in_inches = write(tmp_path, "in.stl", solids.binary_stl(*solids.box(*sides)))
    assert MakeUrdfFromMesh(in_inches, mass=1.0).units[0].unit == "in"
    metric_in_inches = write(tmp_path, "metric.stl", solids.binary_stl(*solids.box(*SIDES / 25.4)))
    belief = MakeUrdfFromMesh(metric_in_inches, density=1000.0).units[0]
    assert belief.unit == "in" and belief.confidence > 0.85
    assert "round numbers in inches" in belief.Describe()


def test_the_mass_tells_the_unit(tmp_path):
    path = write(tmp_path, "c.obj", solids.obj(*solids.box(*SIDES / 10.0)))
    with pytest.raises(UnitsUnsure) as unsure:
        MakeUrdfFromMesh(path)
    assert "--units cm" in unsure.value.question and "60 x 40 x 25 mm" in unsure.value.question
    belief = MakeUrdfFromMesh(path, mass=0.1).units[0]
    assert belief.unit == "cm" and belief.confidence > 0.95 and "kg/m^3" in belief.Describe()


def test_statements_count_unless_the_size_is_absurd(tmp_path):
    sides = SIDES / 10.0
    commented = write(tmp_path, "a.obj", solids.obj(*solids.box(*sides), comment="File units = centimeters"))
    assert MakeUrdfFromMesh(commented).units[0].unit == "cm"
    inches = write(tmp_path, "b.3mf", solids.threemf(*solids.box(3.0, 2.0, 1.0)))
    assert MakeUrdfFromMesh(inches).units[0].unit == "in"
    with pytest.raises(UnitsUnsure, match="25 m "):
        MakeUrdfFromMesh(write(tmp_path, "c.dae", solids.dae(*solids.box(*SIDES), meter="1")))
    model = MakeUrdfFromMesh(tmp_path / "c.dae", units="mm")
    assert model.volume == pytest.approx(60e-3 * 40e-3 * 25e-3)
    assert any("otherwise" in warning for warning in model.warnings)


def test_components_of_3mf_are_placed(tmp_path):
    transform = 'transform="1 0 0 0 1 0 0 0 1 10 20 30"'
    path = write(tmp_path, "t.3mf", solids.threemf(*solids.box(2, 2, 2), unit='unit="millimeter"', transform=transform))
    np.testing.assert_allclose(MakeUrdfFromMesh(path, units="mm").p_BoBcm_B, [0.011, 0.021, 0.031])


# What can not be used.


@pytest.mark.parametrize(
    "name, data, what",
    [
        ("empty.stl", b"", "is empty"),
        ("empty.obj", b" \n", "is empty"),
        ("garbage.stl", bytes(range(256)) * 3, "damaged"),
        ("garbage.ply", b"garbage", "not a PLY"),
        ("garbage.obj", b"v 1 2 three\nf 1 2 3\n", "cannot read the OBJ line"),
        ("garbage.glb", b"glTF" + bytes(40), "not a glTF"),
        ("garbage.3mf", b"PK garbage", "not a 3MF"),
        ("garbage.dae", b"<COLLADA>", "can not be read"),
        ("lol.dae", b'<!DOCTYPE l [<!ENTITY a "b">]><COLLADA/>', "refused"),
        ("cut.stl", solids.binary_stl(*solids.box(1, 1, 1))[:200], "declares 16 triangles, but has room for 2"),
        ("huge.stl", solids.binary_stl(*solids.box(1, 1, 1), count=1_000_000_000), "declares 1000000000"),
        ("huge.ply", solids.ply(*solids.box(1, 1, 1), count=1_000_000_000), "declares 1000000000"),
        ("huge.gltf", b'{"accessors": [{"count": 1000000000}]}', "declares 1000000000"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "vertex 9"),
        ("nothing.obj", b"v 0 0 0\n", "no triangles"),
        ("part.step", b"ISO-10303-21;", "not known"),
    ],
)
def test_damaged_files_say_what_is_wrong(tmp_path, name, data, what):
    path = write(tmp_path, name, data)
    with pytest.raises(ValueError, match=what) as error:
        MakeUrdfFromMesh(path, units="mm", output=tmp_path / "x.urdf")
    assert name in str(error.value)
    assert not (tmp_path / "x.urdf").exists()


@pytest.mark.parametrize("writer", [solids.obj, solids.ply, solids.binary_stl, solids.threemf])
def test_numbers_that_are_none_are_refused(tmp_path, writer):
    vertices, triangles = solids.box(1.0, 1.0, 1.0)
    vertices[5, 1] = np.nan
    path = write(tmp_path, {"binary_stl": "p.stl", "threemf": "p.3mf"}.get(writer.__name__, f"p.{writer.__name__}"),
                 writer(vertices, triangles))  # fmt: skip
    with pytest.raises(ValueError, match="not finite"):
        MakeUrdfFromMesh(path, units="mm")


def test_arguments_are_checked(tmp_path):
    path = write(tmp_path, "p.obj", solids.obj(*solids.box(1.0, 1.0, 1.0)))
    for wrong in ({"mass": 1.0, "density": 1.0}, {"mass": -1.0}, {"density": math.nan}, {"units": "furlong"},
                  {"collision": "none"}):  # fmt: skip
        with pytest.raises(ValueError):
            MakeUrdfFromMesh(path, **{"units": "m", **wrong})
    with pytest.raises(FileNotFoundError):
        MakeUrdfFromMesh(tmp_path / "absent.stl")


def test_an_absurd_mass_is_warned_of(tmp_path):
    path = write(tmp_path, "p.obj", solids.obj(*solids.box(*SIDES)))
    assert any("no material" in w for w in MakeUrdfFromMesh(path, mass=100.0, units="mm").warnings)
    assert any("air" in w for w in MakeUrdfFromMesh(path, mass=1e-6, units="mm").warnings)


# The description.


def load(library, path):
    """Plant with the model, and inspector of its scene graph."""
    import importlib

    plants = importlib.import_module(f"{library}.multibody.plant")
    parsing = importlib.import_module(f"{library}.multibody.parsing")
    framework = importlib.import_module(f"{library}.systems.framework")
    builder = framework.DiagramBuilder()
    plant, scene_graph = plants.AddMultibodyPlantSceneGraph(builder, 1e-3)
    parsing.Parser(plant).AddModels(str(path))
    plant.Finalize()
    return plant, scene_graph.model_inspector()


@pytest.mark.parametrize("collision, pieces", [("mesh", 1), ("hull", 1), ("decompose", None)])
@pytest.mark.parametrize("library", ["sheldrake", pytest.param("pydrake", marks=pytest.mark.peer)])
def test_the_description_loads(tmp_path, library, collision, pieces):
    pytest.importorskip(library)
    outer, inner = 1000.0 * solids.polygon(16, 0.04), 1000.0 * solids.polygon(16, 0.02)
    path = write(tmp_path, "my ring.stl", solids.binary_stl(*solids.extruded(outer, 30.0, [inner])))
    model = MakeUrdfFromMesh(path, mass=0.5, collision=collision, output=tmp_path / "my ring.urdf", origin_at_com=True)
    np.testing.assert_allclose(model.p_BoBcm_B, 0.0, atol=1e-12)
    plant, inspector = load(library, model.path)
    M = plant.GetBodyByName("my_ring").default_spatial_inertia()
    assert M.get_mass() == 0.5
    np.testing.assert_allclose(M.CalcRotationalInertia().CopyToFullMatrix3(), model.I_BBcm_B, rtol=1e-12, atol=1e-16)
    assert inspector.num_geometries() == 1 + (pieces or len(model.files) - 1)
    if collision == "decompose":
        assert 4 <= len(model.files) - 1 <= 16


def test_decomposition_covers_the_solid_tightly():
    from sheldrake.cad._decompose import decompose
    from sheldrake.cad._solids import Solid
    from sheldrake.geometry._meshes.mass_properties import of_polygons

    ring = solids.extruded(solids.polygon(32, 1.0), 0.5, [solids.polygon(32, 0.5)])
    volume = 0.5 * 16 * math.sin(2 * math.pi / 32) * (1.0 - 0.25)
    pieces, error = decompose(Solid("ring", *ring))
    assert 4 <= len(pieces) <= 16 and 0.0 <= error < 0.1  # one hull: 0.33
    assert sum(of_polygons(p).volume for p in pieces) == pytest.approx(volume * (1.0 + error), rel=1e-6)
    centres = ring[0][ring[1]].mean(axis=1)
    assert all(any(_inside(piece, point) for piece in pieces) for point in centres)

    (piece,), error = decompose(Solid("box", *solids.box(1, 1, 1)))
    assert abs(error) < 1e-9 and piece.num_faces() == 6


def _inside(hull, point):
    """Whether a point lies below all faces of a convex polygon mesh."""
    for face in hull._faces:
        a, b, c = (hull._vertices[v] for v in face[:3])
        normal = np.cross(b - a, c - a)
        if (point - a) @ normal > 1e-7 * np.linalg.norm(normal):
            return False
    return True


def test_people_hear_that_contact_fills_holes(tmp_path):
    ring = solids.extruded(solids.polygon(64, 0.03), 0.025, [solids.polygon(64, 0.01)])
    path = write(tmp_path, "ring.obj", solids.obj(*ring))
    said = "in contact the part is its convex hull, 12 % larger"
    made = {kind: MakeUrdfFromMesh(path, mass=0.77, units="m", collision=kind) for kind in ("mesh", "hull")}
    assert any(note.startswith(said) for note in made["mesh"].notes)
    assert not any(note.startswith(said) for note in made["hull"].notes), "who asks for the hull knows"
    assert made["mesh"].p_BoBcm_B.tolist()[:2] == [0.0, 0.0], "rounding is not written"
    assert made["mesh"].I_BBcm_B[0, 1] == 0.0
