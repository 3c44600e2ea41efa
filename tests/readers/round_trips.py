"""Files of other programs, read by stagger, and files of stagger, read by them: equal numbers, or a refusal that says why.

    python tests/readers/round_trips.py target/release/stagger

Needs vtk, meshio, numpy-stl, ase, pandas and ovito. What a library wrote is read again by that library, and stagger must have read the same
bits; where the file is binary or holds all digits, these are also the numbers that were written.
"""

import csv
import itertools
import json
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import ase
import ase.io
import meshio
import numpy as np
import pandas
import stl
import vtk
from ovito.data import DataCollection, Particles
from ovito.io import export_file, import_file
from ovito.pipeline import Pipeline, StaticSource
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

STAGGER = Path(sys.argv[1]).resolve()
COUNT = 300
random = np.random.default_rng(7)
POSITIONS = random.uniform(-1e-3, 1e-3, (COUNT, 3))
RADII = random.uniform(1e-5, 5e-5, COUNT)
VELOCITIES = random.normal(0.0, 0.3, (COUNT, 3))
MATERIALS = random.integers(0, 2, COUNT)

SCENE = """duration = "2 us"
[particles]
start = {{ kind = "file", path = "{path}", materials = ["316L", "Ti-6Al-4V"] }}
gravity = [0, 0, 0]
integrator = "held"
[coupling]
dt = "1 us"
"""


def run(*arguments, cwd):
    return subprocess.run([STAGGER, *arguments], cwd=cwd, capture_output=True, text=True, timeout=120)


def start(file):
    """What stagger reads from a file: positions, radii, velocities, materials; or its message."""
    scene = file.parent / "scene.toml"
    scene.write_text(SCENE.format(path=file.name))
    done = run("check", "scene.toml", "--json", cwd=file.parent)
    if done.returncode:
        assert done.returncode == 2, (done.returncode, done.stderr)
        return done.stderr
    given = json.loads(done.stdout)["physics"]["particles"]["start"]["given"]
    names = ["positions_m", "radii_m", "velocities_m_s", "materials"]
    return [np.array(given[name]) for name in names]


done = []


def check(what, file, expected, single=False):
    """Compares what stagger reads with positions, radii, velocities and materials; None is what the file does not hold.

    Decimal text of a single-precision array is read in double precision by stagger, in single by VTK.
    """
    found = start(file)
    assert not isinstance(found, str), f"{what}: {found}"
    for one, other, name in zip(found, expected, ["positions", "radii", "velocities", "materials"]):
        if other is not None:
            one = one.astype(np.float32) if single and name == "positions" else one
            assert np.array_equal(one, other), f"{what}: {name} differ\n{one}\n{other}"
    done.append(what)


def refused(what, file, *words):
    message = start(file)
    assert isinstance(message, str) and all(word in message for word in words), f"{what}: {message}"
    done.append(what)


# --- VTK ---------------------------------------------------------------------------------------------------------------


def array(values, name, kind=None):
    result = numpy_to_vtk(np.ascontiguousarray(values), deep=True, array_type=kind)
    result.SetName(name)
    return result


def texts(name, values):
    result = vtk.vtkStringArray()
    result.SetName(name)
    for value in values:
        result.InsertNextValue(value)
    return result


def particles(data, single, rich, xml):
    """Points with vertices and data; a rich one has everything that VTK writes beside them."""
    points = vtk.vtkPoints()
    points.SetData(array(POSITIONS.astype(np.float32 if single else np.float64), "Points"))
    data.SetPoints(points)
    cells = vtk.vtkCellArray()
    for row in range(COUNT):
        cells.InsertNextCell(1, [row])
    if isinstance(data, vtk.vtkPolyData):
        data.SetVerts(cells)
    else:
        data.SetCells(vtk.VTK_VERTEX, cells)
    on_points = data.GetPointData()
    if rich:
        names = array(random.normal(size=(COUNT, 3)), "a name, with blanks")
        for component, name in enumerate(["first one", "second", "third"]):
            names.SetComponentName(component, name)
        on_points.AddArray(names)
        on_points.SetScalars(array(np.arange(COUNT, dtype=np.float64), "first"))
        table = vtk.vtkLookupTable()
        table.SetNumberOfTableValues(5)
        table.Build()
        on_points.GetScalars().SetLookupTable(table)
        on_points.SetNormals(array(random.normal(size=(COUNT, 3)).astype(np.float32), "normal"))
        on_points.SetTensors(array(random.normal(size=(COUNT, 9)), "stress"))
        on_points.SetTCoords(array(random.uniform(size=(COUNT, 2)), "texture"))
        on_points.SetGlobalIds(array(np.arange(COUNT), "ids", vtk.VTK_ID_TYPE))
        # The XML writer of VTK 9.7 crashes where these are texts.
        names = texts("pedigree", [f"no {row}\n" for row in range(COUNT)])
        on_points.SetPedigreeIds(array(np.arange(COUNT), "pedigree") if xml else names)
        on_points.AddArray(texts("who", ["" if row % 3 else f"a {row} ä" for row in range(COUNT)]))
        bits = vtk.vtkBitArray()
        bits.SetName("flag")
        for row in range(COUNT):
            bits.InsertNextValue(row % 2)
        on_points.AddArray(bits)
        colours = array(random.integers(0, 256, (COUNT, 3)).astype(np.uint8), "colours")
        data.GetCellData().SetScalars(colours)
        data.GetCellData().AddArray(array(np.full(COUNT, 9.0), "radius"))
        data.GetFieldData().AddArray(array(np.array([0.25]), "TimeValue"))
        data.GetFieldData().AddArray(texts("note", ["me and you\n\nand all"]))
        # Asked for its range, an array remembers it as information, which is written as metadata.
        norms = array(random.normal(size=(COUNT, 3)), "normed")
        norms.GetRange(-1)
        on_points.AddArray(norms)
    on_points.AddArray(array(RADII, "radius"))
    on_points.AddArray(array(VELOCITIES, "velocity"))
    on_points.AddArray(array(MATERIALS, "material"))
    return data


def written(data):
    on_points = data.GetPointData()
    values = lambda name: vtk_to_numpy(on_points.GetArray(name)).astype(np.float64)
    points = vtk_to_numpy(data.GetPoints().GetData()).astype(np.float64)
    return [points, values("radius"), values("velocity"), values("material")]


def read_again(reader, file):
    reader.SetFileName(str(file))
    reader.Update()
    return written(reader.GetOutput())


def legacy_vtk(folder):
    kinds = [(vtk.vtkPolyData, vtk.vtkPolyDataWriter, vtk.vtkPolyDataReader)]
    kinds.append((vtk.vtkUnstructuredGrid, vtk.vtkUnstructuredGridWriter, vtk.vtkUnstructuredGridReader))
    for (data, writer, reader), binary, version, single, rich in itertools.product(
        kinds, [False, True], [42, 51], [False, True], [False, True]
    ):
        what = f"{writer.__name__} {'binary' if binary else 'text'} {version} {single=} {rich=}"
        data = particles(data(), single, rich, xml=False)
        writer = writer()
        file = folder / "a.vtk"
        writer.SetFileName(str(file))
        writer.SetInputData(data)
        writer.SetFileVersion(version)
        (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
        assert writer.Write()
        reader = reader()
        reader.ReadAllScalarsOn(), reader.ReadAllVectorsOn(), reader.ReadAllFieldsOn()
        expected = read_again(reader, file)
        check(what, file, expected, single and not binary)
        if binary:
            check(what, file, written(data))


def xml_vtk(folder):
    kinds = [(vtk.vtkPolyData, vtk.vtkXMLPolyDataWriter, vtk.vtkXMLPolyDataReader, "vtp")]
    kinds.append((vtk.vtkUnstructuredGrid, vtk.vtkXMLUnstructuredGridWriter, vtk.vtkXMLUnstructuredGridReader, "vtu"))
    codings = [("ascii", False), ("binary", False), ("appended", False), ("appended", True)]
    packings = ["None", "ZLib", "LZ4", "LZMA"]
    for (data, make, reader, end), (mode, base64), packing, wide, big, rich in itertools.product(
        kinds, codings, packings, [False, True], [False, True], [False, True]
    ):
        # All of everything takes long, and tells no more.
        if rich and (wide != big or end == "vtu"):
            continue
        what = f"{make.__name__} {mode} {base64=} {packing} {wide=} {big=} {rich=}"
        data = particles(data(), rich, rich, xml=True)
        writer = make()
        file = folder / f"a.{end}"
        writer.SetFileName(str(file))
        writer.SetInputData(data)
        {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary, "appended": writer.SetDataModeToAppended}[mode]()
        writer.SetEncodeAppendedData(base64)
        getattr(writer, f"SetCompressorTypeTo{packing}")()
        # So that there are several blocks.
        writer.SetBlockSize(1024)
        (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
        (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
        assert writer.Write()
        if packing in ["LZ4", "LZMA"]:
            refused(what, file, f"vtk{packing}DataCompressor", "save it with zlib or unpacked")
            continue
        check(what, file, read_again(reader(), file), rich and mode == "ascii")
        if mode != "ascii":
            check(what, file, written(data))


# --- meshio ------------------------------------------------------------------------------------------------------------


def by_meshio(folder):
    data = {"radius": RADII, "velocity": VELOCITIES, "material": MATERIALS}
    mesh = meshio.Mesh(POSITIONS, [("vertex", np.arange(COUNT).reshape(-1, 1))], point_data=data)
    everything = [POSITIONS, RADII, VELOCITIES, MATERIALS]
    for kind, binary in itertools.product(["vtk42", "vtk51"], [False, True]):
        file = folder / "m.vtk"
        mesh.write(file, file_format=kind, binary=binary)
        check(f"meshio {kind} {binary=}", file, everything)
    for binary, compression in [(False, None), (True, None), (True, "zlib"), (True, "lzma")]:
        file = folder / "m.vtu"
        mesh.write(file, file_format="vtu", binary=binary, compression=compression)
        what = f"meshio vtu {binary=} {compression}"
        if compression == "lzma":
            refused(what, file, "vtkLZMADataCompressor", "zlib")
            continue
        again = meshio.read(file)
        columns = [again.points, *(again.point_data[name] for name in data)]
        check(what, file, columns)
        if binary:
            check(what, file, everything)


# --- tables and XYZ ----------------------------------------------------------------------------------------------------


def tables(folder):
    everything = [POSITIONS, RADII, VELOCITIES, MATERIALS]
    frame = pandas.DataFrame(POSITIONS, columns=["x", "y", "z"])
    frame["radius"] = RADII
    frame[["vx", "vy", "vz"]] = VELOCITIES
    frame["material"] = MATERIALS
    frame["note"] = [f'a "{row}", or so\nor not' for row in range(COUNT)]
    file = folder / "t.csv"
    for sep, index, quoting, end in itertools.product(
        [",", ";", "\t"], [False, True], [csv.QUOTE_MINIMAL, csv.QUOTE_ALL, csv.QUOTE_NONNUMERIC], ["\n", "\r\n"]
    ):
        frame.to_csv(file, sep=sep, index=index, quoting=quoting, lineterminator=end)
        check(f"pandas {sep=} {index=} {quoting=} {end=}", file, everything)
    frame.to_csv(file, sep=";", decimal=",", index=False)
    refused("pandas, a comma as decimal mark", file, "write a point, not a comma")
    frame.to_csv(file, sep=";", index=False, encoding="utf-8-sig")
    check("pandas with a byte order mark", file, everything)
    for dialect in csv.list_dialects():
        with open(file, "w", newline="") as out:
            writer = csv.writer(out, dialect)
            writer.writerow(frame.columns)
            writer.writerows(frame.itertuples(index=False))
        check(f"csv {dialect}", file, everything)
    columns = np.column_stack([POSITIONS, RADII, VELOCITIES, MATERIALS])
    names = "x,y,z,radius,vx,vy,vz,material"
    np.savetxt(file, columns, delimiter=",", header=names, comments="", fmt="%.17g")
    check("numpy", file, everything)
    np.savetxt(file, columns, delimiter=",", header=names)
    refused("numpy, names as a comment", file, "expected names such as x,y,z,radius", "a comment")


def xyz(folder):
    atoms = ase.Atoms("Fe" * COUNT, positions=POSITIONS, cell=[1, 1, 1], pbc=[True, False, True])
    atoms.arrays["radius"] = RADII
    atoms.arrays["velo"] = VELOCITIES
    atoms.arrays["material"] = MATERIALS
    atoms.arrays["flag"] = MATERIALS == 1
    atoms.info["note"] = 'it says "Properties=pos:R:3", and more'
    atoms.info["list"] = [1.0, 2.0]
    file = folder / "a.extxyz"
    ase.io.write(file, atoms)
    again = ase.io.read(file)
    columns = [again.positions, *(again.arrays[name] for name in ["radius", "velo", "material"])]
    check("ase", file, columns)
    ase.io.write(file, [atoms, atoms])
    check("ase, two frames", file, columns)
    ase.io.write(folder / "b.xyz", atoms, format="xyz")
    refused("ase, without columns", folder / "b.xyz", "expected Properties=")


def by_ovito(folder):
    data = DataCollection()
    made = Particles()
    made.create_property("Position", data=POSITIONS)
    made.create_property("Radius", data=RADII)
    made.create_property("Velocity", data=VELOCITIES)
    data.objects.append(made)
    pipeline = Pipeline(source=StaticSource(data=data))
    columns = ["Position.X", "Position.Y", "Position.Z", "Radius", "Velocity.X", "Velocity.Y", "Velocity.Z"]
    file = folder / "o.xyz"
    export_file(pipeline, str(file), "xyz", columns=columns, precision=17)
    # Neither its writer nor its reader keeps the last bit: what counts is the text.
    rows = np.array([[float(word) for word in line.split()] for line in file.read_text().splitlines()[2:]])
    assert np.allclose(rows[:, :3], POSITIONS, rtol=1e-12, atol=0)
    check("ovito", file, [rows[:, :3], rows[:, 3], rows[:, 4:], None])
    assert np.allclose(import_file(str(file)).compute().particles.positions[...], rows[:, :3], rtol=1e-12, atol=0)


# --- STL ---------------------------------------------------------------------------------------------------------------


def surfaces(folder):
    """A floor of triangles: each file must give the same bits as the first."""
    edges = np.linspace(-1.0, 1.0, 5)
    triangles = []
    for x, y in itertools.product(range(4), repeat=2):
        a, b, c, d = ([edges[x + i], edges[y + j], (x + i) / 16] for i, j in [(0, 0), (1, 0), (1, 1), (0, 1)])
        triangles += [[a, b, c], [a, c, d]]
    triangles = np.array(triangles, dtype=np.float32)
    mesh = stl.mesh.Mesh(np.zeros(len(triangles), dtype=stl.mesh.Mesh.dtype))
    mesh.vectors[:] = triangles
    poly = vtk.vtkPolyData()
    points = vtk.vtkPoints()
    points.SetData(array(triangles.reshape(-1, 3), "Points"))
    poly.SetPoints(points)
    cells = vtk.vtkCellArray()
    for row in range(len(triangles)):
        cells.InsertNextCell(3, [3 * row, 3 * row + 1, 3 * row + 2])
    poly.SetPolys(cells)
    (folder / "p.csv").write_text("x,y,z,radius\n0.3e-3,0.1e-3,0.3e-3,0.05e-3\n")
    scene = """duration = "10 ms"
[particles]
start = { kind = "file", path = "p.csv" }
contact = { law = "linear", spring = "1000 N/m", restitution = 0.5 }
[walls.m]
mesh = { file = "m.stl", unit = "1 mm" }
[coupling]
dt = "10 us"
"""
    (folder / "scene.toml").write_text(scene)
    file = folder / "m.stl"

    def by_vtk(binary):
        writer = vtk.vtkSTLWriter()
        writer.SetFileName(str(file))
        writer.SetInputData(poly)
        (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
        assert writer.Write()

    surface = meshio.Mesh(triangles.reshape(-1, 3), [("triangle", np.arange(3 * len(triangles)).reshape(-1, 3))])
    writers = {
        "numpy-stl text": lambda: mesh.save(str(file), mode=stl.Mode.ASCII),
        "numpy-stl binary": lambda: mesh.save(str(file), mode=stl.Mode.BINARY),
        "vtk text": lambda: by_vtk(False),
        "vtk binary": lambda: by_vtk(True),
        "meshio text": lambda: surface.write(file, file_format="stl", binary=False),
        "meshio binary": lambda: surface.write(file, file_format="stl", binary=True),
    }
    first = None
    for what, write in writers.items():
        write()
        ran = run("run", "scene.toml", "--in-process", "--no-record", "--json", cwd=folder)
        assert ran.returncode == 0, f"{what}: {ran.stderr}"
        fields = json.loads(ran.stdout)["fields"]
        end = next(field for field in fields if field["field"] == "positions")
        first = first or end
        assert end == first, f"{what}: {end} instead of {first}"
        done.append(what)


# --- and back ----------------------------------------------------------------------------------------------------------


def back(folder):
    """What stagger exports is what it read."""
    frame = pandas.DataFrame(POSITIONS, columns=["x", "y", "z"])
    frame["radius"] = RADII
    frame[["vx", "vy", "vz"]] = VELOCITIES
    frame.to_csv(folder / "s.csv", index=False)
    # Held particles do not move.
    (folder / "scene.toml").write_text(SCENE.format(path="s.csv").replace('integrator = "held"', ""))
    ran = run("run", "scene.toml", "--in-process", "--record", "r.mcap", cwd=folder)
    assert ran.returncode == 0, ran.stderr
    ran = run("export", "r.mcap", "--out", "series", "--vtp", "--csv", cwd=folder)
    assert ran.returncode == 0, ran.stderr
    files = sorted((folder / "series").glob("particles-*.vtp"))
    assert len(files) == 3, files
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(files[0]))
    reader.Update()
    data = reader.GetOutput()
    values = lambda name: vtk_to_numpy(data.GetPointData().GetArray(name))
    assert np.array_equal(vtk_to_numpy(data.GetPoints().GetData()), POSITIONS)
    assert np.array_equal(values("radius"), RADII) and np.array_equal(values("velocity"), VELOCITIES)
    done.append("vtk reads what stagger exports")
    check("stagger reads what stagger exports", files[0], [POSITIONS, RADII, VELOCITIES, None])
    scalars = pandas.read_csv(folder / "series" / "scalars.csv")
    assert len(scalars) == len(files)
    lowest = scalars["field positions z: min [m]"].iloc[0]
    assert lowest == POSITIONS[:, 2].min(), (lowest, POSITIONS[:, 2].min())
    done.append("pandas reads what stagger exports")


for part in [legacy_vtk, xml_vtk, by_meshio, tables, xyz, by_ovito, surfaces, back]:
    with tempfile.TemporaryDirectory() as folder:
        before = len(done)
        part(Path(folder))
        print(f"{part.__name__}: {len(done) - before} files")
versions = ", ".join(f"{name} {version(name)}" for name in ["vtk", "meshio", "numpy-stl", "ase", "ovito", "pandas"])
print(f"{len(done)} files read as their writers meant them: {versions}")
